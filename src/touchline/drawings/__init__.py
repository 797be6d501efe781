"""Drawings in and out: SVG and DXF to templates, templates to pictures, areas to strokes."""
