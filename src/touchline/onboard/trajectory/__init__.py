"""The loaded trajectory as the robot drives it: path, profiles, smoothing and projection."""
