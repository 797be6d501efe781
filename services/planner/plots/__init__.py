"""Plots of a plan: path, speed, curvature and actuators."""
