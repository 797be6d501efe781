"""Shared numerics, independent of the rest of Touchline."""
