"""Things around the robot, from the scans of its lidars."""
