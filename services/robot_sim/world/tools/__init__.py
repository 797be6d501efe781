"""What each kind of tool does to the world."""
