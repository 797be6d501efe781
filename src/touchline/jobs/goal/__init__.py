"""One robot on its way to a goal, in this process or over the bus."""
