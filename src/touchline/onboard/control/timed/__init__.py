"""Trajectory trackers: followers that keep to the reference's place at each time, one for each law."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from touchline.onboard.control.timed.dynamic import DynamicLaw
from touchline.onboard.control.timed.linear import LinearLaw
from touchline.onboard.control.timed.linear_scaled import ScaledLinearLaw
from touchline.onboard.control.timed.nonlinear import NonlinearLaw
from touchline.onboard.control.timed.regularised import RegularisedLaw
from touchline.onboard.control.timed.trajectory_tracker import LawOf, TrajectoryTracker
from touchline.onboard.interface import TICK_S
from touchline.schemas.onboard import TrackingGains
from touchline.schemas.vehicles import Vehicle

__all__ = [
    "TrajectoryTracker",
    "make_dynamic",
    "make_linear",
    "make_linear_scaled",
    "make_nonlinear",
    "make_regularised",
]


def _linear(gains: TrackingGains) -> LinearLaw:
    return LinearLaw(gains.frequency_radps, gains.damping)


def _linear_scaled(gains: TrackingGains) -> ScaledLinearLaw:
    return ScaledLinearLaw(gains.damping, gains.scale_1pm2)


def _nonlinear(gains: TrackingGains) -> NonlinearLaw:
    return NonlinearLaw(gains.damping, gains.scale_1pm2)


def _regularised(gains: TrackingGains) -> RegularisedLaw:
    return RegularisedLaw(gains.frequency_radps, gains.damping, gains.slow_mps)


def _dynamic(gains: TrackingGains) -> DynamicLaw:
    return DynamicLaw(gains.frequency_radps, gains.damping, gains.slow_mps, TICK_S)


def _maker(name: str, law_of: LawOf) -> Callable[[Vehicle, Any], TrajectoryTracker]:
    def make(vehicle: Vehicle, _ask: Any) -> TrajectoryTracker:
        return TrajectoryTracker(name, law_of, vehicle)

    return make


make_linear = _maker("linear", _linear)
make_linear_scaled = _maker("linear-scaled", _linear_scaled)
make_nonlinear = _maker("nonlinear", _nonlinear)
make_regularised = _maker("regularised", _regularised)
make_dynamic = _maker("dynamic", _dynamic)
