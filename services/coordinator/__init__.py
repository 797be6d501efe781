"""The coordinator of a team of robots, as a process."""
