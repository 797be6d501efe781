"""What a covering tool has been over: a template's areas, as a raster while it works and as polygons at the end."""
