"""Free space of a body among known obstacles: proofs that ways exist or do not, the narrowest place, and ways."""
