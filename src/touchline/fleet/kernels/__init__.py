"""Compiled: what has to be done for every pair of robots, or for every robot in every tick."""
