"""Touchline's processes: planner, emulated robots, bridge and coordinator."""
