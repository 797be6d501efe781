"""Free-space tests of the swept body, and detours round obstacles."""
