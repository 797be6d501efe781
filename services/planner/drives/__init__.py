"""The limits of each kind of drive; nothing else in the planner depends on the kind."""
