"""Alignment of a reference track with the estimate."""

from __future__ import annotations

from enum import StrEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.checking.estimating.estimator_run import EstimatorRun

Floats = NDArray[np.float64]


class FrameFit(StrEnum):
    """Allowed difference of a reference's frame."""

    NONE = "none"
    SHIFT = "shift"
    """A constant offset: another origin."""
    RIGID = "rigid"
    """Offset and rotation: another frame (Umeyama 1991, without scale, in the plane)."""


class Compared(NamedTuple):
    """An estimate beside its reference.

    Attributes:
        time_s: (n,) sim time.
        place_m: (n, 2) reference, east and north, aligned with the estimate.
        error_m: (n, 2) estimate minus reference.
        heading_error_rad: (n,) NaN where the reference has no heading.
        covariance: (n, 3, 3) claimed covariance of east, north [m] and heading [rad].
    """

    time_s: Floats
    place_m: Floats
    error_m: Floats
    heading_error_rad: Floats
    covariance: Floats


def aligned(run: EstimatorRun, alignment: FrameFit) -> Compared:
    """Compare where both exist."""
    time_s = run.reference[:, 0]
    at = time_s * 100.0
    below = np.floor(at + 1e-6).astype(np.int64)
    inside = (below >= 1) & (below + 1 < len(run.poses))
    time_s, at, below, reference = time_s[inside], at[inside], below[inside], run.reference[inside, 1:]
    share = np.clip(at - below, 0.0, 1.0)[:, None]
    pose = (1.0 - share) * run.poses[below] + share * run.poses[below + 1]
    there = np.isfinite(pose).all(axis=1) & np.isfinite(reference[:, :2]).all(axis=1)
    time_s, pose, reference, claimed = time_s[there], pose[there], reference[there], run.covariances[below[there]]
    place = pose[:, :2]
    if run.of_antenna:
        body = run.setup.vehicle.body
        cos, sin = np.cos(pose[:, 2]), np.sin(pose[:, 2])
        x, y = body.gnss_antenna_x_m, body.gnss_antenna_y_m
        place = place + np.column_stack([cos * x - sin * y, sin * x + cos * y])
    laid, turn = _laid(reference[:, :2], place, alignment)
    return Compared(time_s, laid, place - laid, pose[:, 2] - reference[:, 2] - turn, claimed)


def _laid(reference: Floats, place: Floats, alignment: FrameFit) -> tuple[Floats, float]:
    """Return the reference aligned in the least-squares sense, and its rotation [rad]."""
    if alignment is FrameFit.NONE or not len(place):
        return reference, 0.0
    middle, aim = reference.mean(axis=0), place.mean(axis=0)
    if alignment is FrameFit.SHIFT:
        return reference - middle + aim, 0.0
    a, b = reference - middle, place - aim
    turn = float(np.arctan2((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum(), (a * b).sum()))
    cos, sin = np.cos(turn), np.sin(turn)
    return a @ np.array([[cos, sin], [-sin, cos]]) + aim, turn
