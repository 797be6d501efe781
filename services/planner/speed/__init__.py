"""Speed along the path within the limits of the wheels (TOPP), and what is actuated when."""
