"""Coverage of areas: swaths at the tool's width, and routes of tools that work wherever they pass."""
