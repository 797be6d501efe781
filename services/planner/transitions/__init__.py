"""Fastest transitions between swaths by a steering method."""
