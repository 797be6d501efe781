"""Trajectory message and report of a plan."""
