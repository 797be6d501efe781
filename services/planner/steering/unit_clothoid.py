"""Compiled: clothoids of unit sharpness, as complex displacements.

The clothoid from straight to curvature k is the Fresnel integral g(k) = ∫₀ᵏ exp(iu²/2) du, here by its power series
(Abramowitz and Stegun, "Handbook of Mathematical Functions", 7.3.11 and 7.3.13), which up to k = √π (a turn by π/2) is
exact to rounding.
"""

import math

import numpy as np

from touchline.core.arcs import unit
from touchline.core.jit import kernel
from touchline.services.planner.geometry.clothoid import NODES, PANEL_TURN_RAD, WEIGHTS

CURVATURE_CAP = math.sqrt(math.pi)
_TERMS = 12
_COS = np.array([(-1.0) ** m / (math.factorial(2 * m) * (4 * m + 1)) for m in range(_TERMS)])
_SIN = np.array([(-1.0) ** m / (math.factorial(2 * m + 1) * (4 * m + 3)) for m in range(_TERMS)])


@kernel
def spiral(k: float) -> complex:
    """Displacement along the clothoid from straight to curvature |k| ≤ √π; odd in `k`."""
    turn = 0.5 * k * k
    square = turn * turn
    cosine, sine = 0.0, 0.0
    for m in range(_TERMS - 1, -1, -1):
        cosine = cosine * square + _COS[m]
        sine = sine * square + _SIN[m]
    return complex(k * cosine, k * turn * sine)


@kernel
def ramp(heading: float, k_from: float, k_to: float) -> tuple[complex, float]:
    """Displacement and turn (rad) along the clothoid from one curvature to another, driven forward.

    Args:
        heading: At its beginning (rad).
        k_from: Curvature there, at most √π in magnitude.
        k_to: Curvature at its end, at most √π in magnitude.
    """
    turn = 0.5 * (k_from + k_to) * abs(k_to - k_from)
    if k_to >= k_from:
        return unit(heading - 0.5 * k_from * k_from) * (spiral(k_to) - spiral(k_from)), turn
    return unit(heading + 0.5 * k_from * k_from) * (spiral(k_from) - spiral(k_to)).conjugate(), turn


@kernel
def steep_ramp(k_from: float, k_to: float) -> tuple[complex, float]:
    """Displacement and turn as of `ramp` from heading 0, for any curvatures, by Gauss-Legendre quadrature in panels.

    Args:
        k_from: Curvature at its beginning.
        k_to: Curvature at its end.
    """
    if max(abs(k_from), abs(k_to)) <= CURVATURE_CAP:
        move, turn = ramp(0.0, k_from, k_to)
        return move, turn
    length, side = abs(k_to - k_from), math.copysign(1.0, k_to - k_from)
    panels = 1 + int(max(abs(k_from), abs(k_to)) * length / PANEL_TURN_RAD)
    h = length / panels
    move = 0j
    for panel in range(panels):
        for node in range(len(NODES)):
            at = (panel + NODES[node]) * h
            move += h * WEIGHTS[node] * unit((k_from + 0.5 * side * at) * at)
    return move, 0.5 * (k_from + k_to) * length
