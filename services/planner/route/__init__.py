"""Route: run-in, swaths with the transitions between them, and run-out."""
