"""One job from template to report, over the bus or in one process, and many of them; reports and pictures."""
