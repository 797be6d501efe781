"""Committed plans: a second way to keep a team's robots apart, which takes time into account."""
