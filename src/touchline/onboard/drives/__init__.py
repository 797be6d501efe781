"""The onboard side of each kind of drive; nothing else in the robot's computer depends on the kind."""
