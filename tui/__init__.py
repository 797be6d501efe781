"""The operator's console: a terminal that watches and commands the robot over the bus."""
