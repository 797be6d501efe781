"""Dispatch: requests, their assignment to robots by time and charge, and their execution."""
