"""Compiled: the raster of what is covered, and the search for ways from stroke to stroke on it."""
