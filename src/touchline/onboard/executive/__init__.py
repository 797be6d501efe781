"""Executive: state machine, mission, sprayer, failsafe, geofence, localization monitor."""
