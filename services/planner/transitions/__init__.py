"""Transitions from painted curve to painted curve by Dubins words, of plain and of curvature-continuous turns."""
