"""The true world: the body on the ground, its motors, its valve and disc, its battery and its tank."""
