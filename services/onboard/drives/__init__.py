"""What the robot's own computer knows of each kind of drive; nothing else in it asks which kind it is."""
