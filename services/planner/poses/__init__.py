"""Paths between two poses, such as from the robot's pose to a goal, and speed laws along them."""
