"""Emulated sensors, one module each: they see the true world and add errors of their own."""
