"""Operator's console: a terminal that watches and commands robots over the bus."""
