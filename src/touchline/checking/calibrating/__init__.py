"""Calibration: constants of a robot from a recording of a drive."""
