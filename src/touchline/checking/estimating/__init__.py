"""The estimator alone on the sensors of a session, and its evaluation."""
