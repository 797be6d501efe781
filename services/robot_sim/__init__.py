"""The emulated robot: true world, sensors, its own computer, and the accounts of its work."""
