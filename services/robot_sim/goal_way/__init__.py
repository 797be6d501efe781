"""Ground that a robot on its way to a goal has seen, and the way ahead on it."""
