"""What is measured: honest sensors that see the world and add their own errors."""
