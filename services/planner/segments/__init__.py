"""Segments: the route as lines and arcs, which is all that the robot executes."""
