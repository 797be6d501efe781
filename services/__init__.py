"""Touchline's processes and what they share."""
