"""A job of one robot that waits for what stands in its way, goes round it, and returns to what it has left out."""
