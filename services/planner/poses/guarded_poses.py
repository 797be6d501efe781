"""Checks of what pose methods and speed laws of plug-ins return."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Final

import numpy as np

from touchline.schemas.plugins import POSE_METHODS, SPEED_LAWS
from touchline.services.planner.geometry.clothoid import Floats, PathPose, PiecePath
from touchline.services.planner.plugin_answers import Blame, blaming, called, leading
from touchline.services.planner.poses.pose_method import PoseMethod, PosePath
from touchline.services.planner.poses.speed_laws import SpeedLaw
from touchline.services.planner.poses.traveller import Traveller

_TAUS: Final = np.linspace(0.0, 1.0, 201)
_ROUNDED: Final = 1e-6


def guarded_pose_method(method: PoseMethod, name: str) -> PoseMethod:
    """Wrap a plug-in's pose method in checks that its path is sound and leads to the goal."""
    blame = blaming(POSE_METHODS, name)
    return method if blame is None else _GuardedPoseMethod(method, blame)


def guarded_law(law: SpeedLaw | None, name: str) -> SpeedLaw | None:
    """Check a plug-in's speed law.

    Raises:
        PlanningError: It is no speed law.
    """
    blame = blaming(SPEED_LAWS, name)
    return law if blame is None or law is None else _checked(law, blame)


class _GuardedPoseMethod:
    """`PoseMethod` that checks the path of another one."""

    def __init__(self, inner: Any, blame: Blame) -> None:
        self._inner, self._blame = inner, blame

    def between(self, start: PathPose, goal: PathPose, traveller: Traveller) -> PosePath:
        found = called(self._blame, self._inner.between, start, goal, traveller)
        if not (isinstance(found, PosePath) and isinstance(found.path, PiecePath)):
            raise self._blame(f"it gave a {type(found).__name__} instead of a PosePath")
        leading((), start, found.path.start, self._blame)
        free = goal._replace(heading_rad=math.nan)  # it may choose another heading, and notes it
        leading(found.path.pieces, found.path.start, free, self._blame)
        if found.progress is not None:
            columns = [np.asarray(each, dtype=np.float64) for each in vars(found.progress).values()]
            rises = all(bool((np.diff(each) > 0.0).all()) for each in columns[:2])
            if not (all(np.isfinite(each).all() for each in columns) and rises):
                raise self._blame("its curve's progress is not finite, or does not rise")
        return found


def _checked(law: Any, blame: Blame) -> SpeedLaw:
    if not isinstance(law, SpeedLaw):
        raise blame(f"it is {law!r}, not a SpeedLaw")
    s, rate = (called(blame, _floats, function, _TAUS.copy()) for function in (law.s, law.rate))
    if s.shape != _TAUS.shape or rate.shape != _TAUS.shape:
        raise blame(f"of {_TAUS.shape} times it gives {s.shape} places and {rate.shape} rates")
    if not (np.isfinite(s).all() and np.isfinite(rate).all()):
        raise blame("it gives numbers that are not finite")
    if abs(s[0]) > _ROUNDED or abs(s[-1] - 1.0) > _ROUNDED or np.diff(s).min() < -_ROUNDED or rate.min() < -_ROUNDED:
        raise blame("its s(τ) does not rise from 0 to 1")
    if abs(float(np.trapezoid(rate, _TAUS)) - 1.0) > 0.05:
        raise blame("its rate is not the derivative of its s(τ)")
    return law


def _floats(function: Callable[[Floats], Any], given: Floats) -> Floats:
    return np.asarray(function(given), dtype=np.float64)
