"""The bridge: recordings (MCAP) of what is on the bus, their replay and their comparison."""
