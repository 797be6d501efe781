"""Protection against contact: lowers the robot's speed, and stops it, for what its sensors see."""
