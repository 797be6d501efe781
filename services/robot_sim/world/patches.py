"""Patches: a map of the wheels' slip over the ground, alike on each pass.

The map is a sum of plane waves with normally distributed wavenumbers: its correlation is exp(−d²/2L²) at the distance d
(M. Shinozuka and G. Deodatis, "Simulation of stochastic processes by spectral representation", Applied Mechanics
Reviews 44(4), 1991).
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel
from touchline.core.random import STREAM_PATCHES, normal, uniform
from touchline.schemas.truth import Truth
from touchline.services.robot_sim.world.body import BodyState
from touchline.services.robot_sim.world.roughness import STANCE_M, height_m

_WAVES: Final = 48

Floats = NDArray[np.float64]


def patches_of(truth: Truth, seed: int) -> Floats:
    """Make the waves of the map of slip.

    Args:
        truth: Gives σ and correlation length.
        seed: Seed of the scenario.

    Returns:
        (n, 4) waves, as those of the ground's heights; none without patches.
    """
    if truth.patch_slip_relative == 0.0:
        return np.zeros((0, 4))
    waves = np.zeros((_WAVES, 4))
    for wave in range(_WAVES):
        waves[wave, 0] = normal(seed, STREAM_PATCHES, wave, 0) / truth.patch_m
        waves[wave, 1] = normal(seed, STREAM_PATCHES, wave, 1) / truth.patch_m
        waves[wave, 2] = 2.0 * math.pi * uniform(seed, STREAM_PATCHES, wave, 2)
    waves[:, 3] = truth.patch_slip_relative * math.sqrt(2.0 / _WAVES)
    return waves


@kernel
def slip_here(state: BodyState, patches: Floats) -> None:
    """Update the slip of the place of each side's wheels.

    Args:
        state: State of the body, with the slip of the left and the right side.
        patches: Of `patches_of`.
    """
    aside_east = -0.5 * STANCE_M * math.sin(state.heading_rad)
    aside_north = 0.5 * STANCE_M * math.cos(state.heading_rad)
    state.patch_slip[0] = height_m(patches, state.east_m + aside_east, state.north_m + aside_north)
    state.patch_slip[1] = height_m(patches, state.east_m - aside_east, state.north_m - aside_north)
