"""Study of obstacles: protection and ways to goals beside the usual rules and planners."""
