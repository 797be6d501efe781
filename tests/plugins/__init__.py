"""Plug-ins as other packages bring them, each in a folder or file of its own."""
