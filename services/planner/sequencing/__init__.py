"""Order and directions in which segments are painted, by time and wet paint."""
