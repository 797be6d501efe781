"""Effects of each kind of tool on the world."""
