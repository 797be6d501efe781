"""Swaths: lines that are painted without a break, and the paths of the robot's centre along them."""
