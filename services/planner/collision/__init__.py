"""Collision checks of the swept body, and detours around obstacles."""
