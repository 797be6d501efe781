"""Study of a network of small robots: its rules, with which they collide, compared with ours."""
