"""How each kind of drive moves the robot: what is commanded of its actuators, forces, and the angles that it turns."""
