"""Run-in, transitions and run-out: the transition from swath to swath, and the route that they make with them."""
