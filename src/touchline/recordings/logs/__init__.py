"""Logs of other robots and receivers, read as tables and as the sensors of a robot of ours."""
