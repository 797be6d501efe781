"""Objects of a scenario in the world: where they are, how they move, and their contacts with the robot."""
