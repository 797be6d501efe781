"""Checking recordings: each is rebuilt from itself by the code of today, and compared with that."""
