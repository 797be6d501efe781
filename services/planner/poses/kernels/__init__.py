"""Compiled: cubic curves and the choice among them, turn-line-turn, paths to a point, and checks of speed laws."""
