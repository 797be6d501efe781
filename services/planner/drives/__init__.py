"""What plans keep to for each kind of drive; nothing else in the planner asks which kind it is."""
