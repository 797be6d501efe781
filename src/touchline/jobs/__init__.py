"""Jobs: one robot on a template or to a goal, robots that share a template, teams, and sweeps of many."""
