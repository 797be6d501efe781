"""Compiled: cubic curves and the choice among them, turn-line-turn, paths to a point, and whether a law fits."""
