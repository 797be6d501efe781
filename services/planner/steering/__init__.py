"""Steering: shortest curvature-continuous paths between two poses and curvatures, in compiled kernels.

All modules but `g2.py` and `word_lengths.py` use units in which the maximum sharpness is 1: lengths are multiplied by
√σ_max and curvatures divided by it, so that κ_max/√σ_max is the only limit.
"""
