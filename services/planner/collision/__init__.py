"""Free-space tests of the swept body, and ways round what is in the way."""
