"""Checks of recordings: each session is rebuilt from its recording by the present code, and compared with it."""
