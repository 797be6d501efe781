"""Multipath at places: a map of errors that bends the fixes there, alike on each pass, and drifts with the satellites.

The map of an axis is a sum of waves over the ground and time with normally distributed wavenumbers and frequencies:
its correlation is exp(−d²/2L² − t²/2T²) at the distance d and after the time t (M. Shinozuka and G. Deodatis,
"Simulation of stochastic processes by spectral representation", Applied Mechanics Reviews 44(4), 1991). Every number of
it is drawn anew from the seed, so it has no state.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel
from touchline.core.random import STREAM_MULTIPATH, normal, uniform
from touchline.core.records import Record
from touchline.onboard.interface import TICK_S
from touchline.schemas.scenario import Scenario
from touchline.services.robot_sim.sensors.moment import Moment
from touchline.services.robot_sim.sensors.zones import PlaceOutline, Zones, distance, make_zones

_WAVES: Final = 16
_NUMBERS: Final = 4  # of a wave: east, north, time, phase

Floats = NDArray[np.float64]


class MultipathPlace(Record):
    """Place of the scenario whose reflections bend fixes."""

    outline: PlaceOutline
    margin_m: float
    """Width of the border around it over which the error falls to nothing."""
    error_m: float
    """Error inside, 1 σ an axis."""
    length_m: float
    """Correlation length L."""
    drift_s: float
    """Correlation time T."""


@kernel
def _map(seed: int, place: int, axis: int, scaled: tuple[float, float, float]) -> float:
    """Return the map of an axis, with standard deviation 1, at a place and time in correlation lengths and times."""
    found = 0.0
    for wave in range(_WAVES):
        first = (axis * _WAVES + wave) * _NUMBERS
        phase = 2.0 * math.pi * uniform(seed, STREAM_MULTIPATH, place, first + 3)
        for number in range(3):
            phase += scaled[number] * normal(seed, STREAM_MULTIPATH, place, first + number)
        found += math.cos(phase)
    return found * math.sqrt(2.0 / _WAVES)


@kernel
def bend_m(moment: Moment, index: int, multipath: Zones, east: float, north: float, position: Floats) -> None:
    """Add the error of one place to a position.

    Args:
        moment: End of the tick of validity.
        index: Number of the place.
        multipath: Places of kind `MultipathPlace`.
        east: True east of the antenna, map frame [m].
        north: True north of it.
        position: East, north [m], updated; the height is not bent.
    """
    place = multipath.places[index]
    away = distance(place.outline, multipath.vertices, east, north)
    if away > place.margin_m:
        return
    share = 1.0 - away / place.margin_m if away > 0.0 else 1.0
    scaled = east / place.length_m, north / place.length_m, moment.tick * TICK_S / place.drift_s
    for axis in range(2):
        position[axis] += share * place.error_m * _map(moment.seed, index, axis, scaled)


def multipath_of(scenario: Scenario) -> Zones:
    """Make the scenario's places of kind `MultipathPlace`."""
    return make_zones(
        MultipathPlace,
        ((each.outline, (each.margin_m, each.error_m, each.length_m, each.drift_s)) for each in scenario.multipath),
    )
