"""Aiding of the filter, one module for each sensor: samples, rows with Jacobian, gates, noise and updates."""
