"""State estimation: a 12-state EKF on IMU, wheel encoders, magnetometer and delayed positions of GNSS or a camera."""
