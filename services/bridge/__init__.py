"""The bridge: records robots on request, shows them to ROS 2 and to viewers, and replays."""
