"""The fastest transition between two swaths, of those that the steering method offers."""
