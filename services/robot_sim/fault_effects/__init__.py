"""What each kind of fault does to the robot: a function for each, as the rows of `FAULTS` name them."""
