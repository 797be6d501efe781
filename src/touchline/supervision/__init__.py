"""Supervision of processes: start, watch, restart, stop; and their private files."""
