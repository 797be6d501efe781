"""Touchline: plans, drives and records the work of ground robots.

The parts of this package are folders of the repository's own: the links beside this file put them into it.
"""
