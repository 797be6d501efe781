"""Limits of each kind of drive, the only part of the planner that depends on the kind."""
