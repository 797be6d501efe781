"""Processes: start, watch, restart, stop; what they may read and write."""
