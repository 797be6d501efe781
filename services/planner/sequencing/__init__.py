"""The order in which segments are painted, and which way round: the least time, and wheels off wet paint."""
