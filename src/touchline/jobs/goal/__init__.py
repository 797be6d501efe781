"""One robot driving to a goal, in this process or over the bus."""
