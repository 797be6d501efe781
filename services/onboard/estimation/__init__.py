"""Where the robot believes it is: a 12-state EKF over IMU, wheel encoders, magnetometer and delayed RTK-GNSS."""
