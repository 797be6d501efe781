"""Calibration drives: in one process, and over the bus."""
