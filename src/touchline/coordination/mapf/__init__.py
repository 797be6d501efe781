"""Ways for many robots on a grid: who is where at which step, found together, refined, and driven in their order."""
