"""Accounts of a covering tool's work on a template's areas: a raster while it works, and polygons at the end."""
