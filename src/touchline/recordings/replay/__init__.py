"""Replay of a recording at its own times or at others."""
