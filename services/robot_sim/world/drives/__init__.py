"""Motion of each kind of drive in the world: response to commands, forces, and actuator angles."""
