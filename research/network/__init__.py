"""The study of a network of small robots: its rules, by which they collide, and ours beside it."""
