"""Sharing a template among several robots: which of them paints which swaths."""
