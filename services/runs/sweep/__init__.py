"""Many simulations at once: which, where, and what came out."""
