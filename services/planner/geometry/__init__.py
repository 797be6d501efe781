"""Paths as pieces of line, arc and clothoid."""
