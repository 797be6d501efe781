"""Shape of the ground: a field of heights over the map, alike on each pass; rough by its class of ISO 8608, or waved.

Along any line the heights have the one-sided spectrum G(n) = G₀·(n/n₀)⁻², n₀ = 0.1 /m, from 0.01 /m to the 5 /m at
which a tyre no longer follows (assumed). The field is isotropic: plane waves in all directions, of which those between
the wavenumbers k₁ and k₂ have the variance π/2·G₀·n₀²·(1/k₁ − 1/k₂). Tracks beside each other are correlated by that
alone (C. J. Dodds and J. D. Robson, "The description of road surface roughness", Journal of Sound and Vibration 31(2),
1973).
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel
from touchline.core.random import STREAM_ROUGHNESS, uniform
from touchline.schemas.scenario import Ground, GroundWave, Roughness

SPECTRUM_M3: Final[dict[Roughness, float]] = {"none": 0.0, "A": 16e-6, "B": 64e-6, "C": 256e-6, "D": 1024e-6}
"""G₀ by class: geometric means of ISO 8608."""
STANCE_M: Final = 0.5
"""Distance of the wheels from each other, and of the front from the axle, over which the robot leans (assumed)."""
_REFERENCE_1PM = 0.1
_LEAST_1PM, _MOST_1PM = 0.01, 5.0 * 4.0 / math.pi  # along a line the waves' slopes then count as up to a sharp 5 /m
_WAVES = 96
_GOLDEN = math.pi * (3.0 - math.sqrt(5.0))

Floats = NDArray[np.float64]

# Columns of a wave.
_EAST: Final = 0  # rad/m
_NORTH: Final = 1
_PHASE: Final = 2
_HEIGHT: Final = 3
_COLUMNS: Final = 4


def shape_of(ground: Ground, seed: int) -> Floats:
    """Make the waves of a ground: those of its roughness, no two seeds alike, then its crown and ruts.

    Args:
        ground: The ground.
        seed: Seed of the scenario.

    Returns:
        (n, 4) waves for `height_m`; none of a smooth ground.
    """
    rough = _rough(SPECTRUM_M3[ground.roughness] * ground.roughness_factor**2, seed)
    return np.vstack([rough, *map(_given_wave, ground.waves)])


def _given_wave(wave: GroundWave) -> Floats:
    number = 2.0 * math.pi / wave.length_m
    east, north = number * math.cos(wave.across_rad), number * math.sin(wave.across_rad)
    return np.array([[east, north, -(east * wave.crest_x_m + north * wave.crest_y_m), 0.5 * wave.rise_m]])


def _rough(spectrum: float, seed: int) -> Floats:
    """Return waves of rough ground: the shorter the closer to each other, in directions that are spread evenly.

    Args:
        spectrum: G₀ [m³].
        seed: Seed of the scenario.
    """
    if spectrum == 0.0:
        return np.zeros((0, _COLUMNS))
    bounds = _LEAST_1PM + (_MOST_1PM - _LEAST_1PM) * np.linspace(0.0, 1.0, _WAVES + 1) ** 2
    variance = 0.5 * math.pi * spectrum * _REFERENCE_1PM**2 * (1.0 / bounds[:-1] - 1.0 / bounds[1:])
    place, phase = (
        np.array([uniform(seed, STREAM_ROUGHNESS, wave, channel) for wave in range(_WAVES)]) for channel in range(2)
    )
    number = 2.0 * math.pi * (bounds[:-1] + place * np.diff(bounds))
    direction = _GOLDEN * np.arange(_WAVES) + 2.0 * math.pi * uniform(seed, STREAM_ROUGHNESS, 0, 2)
    waves = np.zeros((_WAVES, _COLUMNS))
    waves[:, _EAST], waves[:, _NORTH] = number * np.cos(direction), number * np.sin(direction)
    waves[:, _PHASE], waves[:, _HEIGHT] = 2.0 * math.pi * phase, np.sqrt(2.0 * variance)
    return waves


@kernel
def height_m(waves: Floats, east: float, north: float) -> float:
    """Return the height of the ground at a place [m], or another sum of waves.

    Args:
        waves: Of `shape_of`.
        east: East, map frame [m].
        north: North, map frame [m].
    """
    height = 0.0
    for index in range(len(waves)):
        wave = waves[index]
        height += wave[_HEIGHT] * math.cos(wave[_EAST] * east + wave[_NORTH] * north + wave[_PHASE])
    return height


@kernel
def stance(waves: Floats, east: float, north: float, cos: float, sin: float) -> tuple[float, float, float]:
    """Return slopes and height of a robot on rough ground: ahead, to the left (rise over run), and its axle's [m].

    Args:
        waves: Of `shape_of`.
        east: East of the body's origin, map frame [m].
        north: North of it.
        cos: Of the heading.
        sin: Of the heading.
    """
    half = 0.5 * STANCE_M
    left = height_m(waves, east - half * sin, north + half * cos)
    right = height_m(waves, east + half * sin, north - half * cos)
    front = height_m(waves, east + STANCE_M * cos, north + STANCE_M * sin)
    middle = 0.5 * (left + right)
    return (front - middle) / STANCE_M, (left - right) / STANCE_M, middle
