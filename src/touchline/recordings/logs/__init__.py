"""Logs of other robots and receivers: what is in them, as tables, and as the sensors of a robot of ours."""
