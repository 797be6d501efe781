"""Trajectory trackers: followers that are where their reference is, at its time."""
