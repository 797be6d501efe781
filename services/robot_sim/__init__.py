"""The emulated robot: what is true, what is measured, what its own computer does, and what got painted."""
