"""Traffic rules of robots that each follow a path of their own: who goes first, and how far each may drive now."""
