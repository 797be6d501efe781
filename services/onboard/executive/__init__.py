"""What the robot does when: state machine, mission, sprayer, failsafe, geofence, localization monitor."""
