"""Compiled: raster of covered ground, and search for transitions between strokes."""
