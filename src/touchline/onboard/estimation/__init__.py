"""State estimation: a 12-state EKF over IMU, wheel encoders, magnetometer and delayed RTK-GNSS."""
