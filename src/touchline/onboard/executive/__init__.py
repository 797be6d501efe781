"""The executive: state machine, mission, sprayer, failsafe, geofence, localization monitor."""
