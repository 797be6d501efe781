"""Division of a template among several robots."""
