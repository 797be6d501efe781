"""From a template's lines to swaths: what is painted in one go, and the path of the robot's centre for it."""
