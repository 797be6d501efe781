"""One template, several robots: planned together, kept apart, and judged together."""
