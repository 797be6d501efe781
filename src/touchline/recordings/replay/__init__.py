"""Replay: what a recording says, at its own times or at others."""
