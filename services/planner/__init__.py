"""The planner: from a template of painted lines to a trajectory that the robot can drive and paint."""
