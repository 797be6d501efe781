"""The Trajectory message and the figures of a plan."""
