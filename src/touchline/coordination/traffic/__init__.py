"""Traffic rules of robots that each follow their own path: who goes first, and how far each may drive now."""
