"""The bridge: records robots on request, connects them with ROS 2 and viewers, and replays recordings."""
