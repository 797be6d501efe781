"""Recordings: MCAP files written, read, compared, salvaged, exported, and imported from others' logs."""
