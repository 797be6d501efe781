"""Sweeps: many simulations at once, their combinations, workers and summary."""
