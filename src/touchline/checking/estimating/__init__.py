"""The estimator alone on the sensors of a session, and what is to be said of it."""
