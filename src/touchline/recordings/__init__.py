"""Recordings: MCAP files written, read, compared, salvaged, exported, and made of logs of others."""
