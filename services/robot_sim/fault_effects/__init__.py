"""Effects of faults on the robot: a function for each kind, which its row of `FAULTS` names."""
