"""Coordination of a large team by regions, each a coordinator of its own."""
