"""Speed along the path within the limits of the drive (TOPP), and switching of the tool."""
