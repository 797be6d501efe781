"""Numerics that every part shares; it knows nothing of Touchline."""
