"""Areas that are painted solid, as swaths at the tool's width."""
