"""Compiled: cubic curves and the choice among them, shortest paths to a point, and whether a law keeps the limits."""
