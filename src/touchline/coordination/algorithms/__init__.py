"""Algorithms of users that decide where the robots of a team drive; docs/guides/team-algorithms.md shows how."""
