"""Steering: the shortest curvature-continuous paths between two poses and curvatures, in compiled kernels.

Everything in here but `g2.py` and `word_lengths.py` is in units in which the largest sharpness is 1: lengths are
multiplied by √σ_max and curvatures divided by it. Only κ_max/√σ_max is left of the limits.
"""
