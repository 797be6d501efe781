"""Kernels over every pair of robots, or every robot in every tick."""
