"""Import of foreign logs as sessions."""
