"""Paths between two poses, such as from where the robot stands to a goal, and laws of when it is where along them."""
