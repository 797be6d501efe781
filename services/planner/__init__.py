"""Planner: from a template to a trajectory that the robot can drive and paint."""
