"""Areas in any number of pieces: conversion, extents and rotation."""

import math

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from touchline.services.planner.geometry.clothoid import Floats

Area = shapely.Polygon | shapely.MultiPolygon


def extents(shape: BaseGeometry, more_than_m2: float = 0.0) -> list[tuple[float, float]]:
    """Intervals along x (m) that the pieces of a shape cover, ascending, overlapping ones merged.

    Args:
        shape: Shape in the frame of that x (m).
        more_than_m2: Smaller pieces, which come from rounding, do not count.
    """
    pieces = shapely.get_parts(shape)
    bounds = sorted((a, b) for a, _, b, _ in shapely.bounds(pieces[shapely.area(pieces) > more_than_m2]).tolist())
    merged: list[tuple[float, float]] = []
    for a, b in bounds:
        if merged and a <= merged[-1][1]:
            merged[-1] = (merged[-1][0], max(merged[-1][1], b))
        else:
            merged.append((a, b))
    return merged


def turned(points: Floats, angle_rad: float) -> Floats:
    """Rotate points (n, 2) about the origin."""
    cos, sin = math.cos(angle_rad), math.sin(angle_rad)
    return np.column_stack((cos * points[:, 0] - sin * points[:, 1], sin * points[:, 0] + cos * points[:, 1]))
