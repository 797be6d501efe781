"""Compiled: cubic curves between two poses, their price, and their approximation by clothoids.

Points are complex numbers x + iy. With p(0), p(1) the ends and k_i, k_f the lengths of the tangents there,

    p(s) = s³·p_f − (s − 1)³·p_i + α·s²(s − 1) + β·s(s − 1)²,   α = k_f·e^{iθ_f} − 3p_f,   β = k_i·e^{iθ_i} + 3p_i

is the cubic Hermite curve with p'(0) = k_i·e^{iθ_i} and p'(1) = k_f·e^{iθ_f} (Siciliano, Sciavicco, Villani, Oriolo,
"Robotics: Modelling, Planning and Control", 11.5.3). Both lengths positive: driven forward; both negative: backward.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from touchline.core.angles import wrapped
from touchline.core.jit import kernel
from touchline.services.planner.drives.caps import Caps, square_cap
from touchline.services.planner.geometry.clothoid import NODES, WEIGHTS, Floats

# Minimum |p'| of a chosen curve, as a fraction of the distance: near 0, curvature is unbounded.
SLOWEST_SHARE = 0.05
# Candidates for k_i and k_f as factors of the distance, the plainest first, which wins ties.
FACTORS = np.array([1.0, 0.8, 1.3, 0.6, 1.6, 0.4, 2.0, 2.6])
# Samples of a curve: in the rough search, and of the best curves.
ROUGH, FINE = 32, 256
# Initial step of the refinement (of log k), and number of halvings.
FIRST_STEP, HALVINGS = 0.14, 5
# A curve must be quicker by this fraction to replace an earlier one.
QUICKER = 1e-9


class CubicCurve(NamedTuple):
    """Ends (m) and the other two coefficients (m) of a curve, complex numbers or arrays of one shape."""

    start: Any
    goal: Any
    alpha: Any
    beta: Any


@kernel
def cubic_curve(start: Any, goal: Any, leaving: Any, arriving: Any) -> CubicCurve:
    """Create the curve between two points with given tangents.

    Args:
        start: p(0), x + iy (m).
        goal: p(1), x + iy (m).
        leaving: p'(0) = k_i·e^{iθ_i} (m).
        arriving: p'(1) = k_f·e^{iθ_f} (m).
    """
    return CubicCurve(start, goal, arriving - 3.0 * goal, leaving + 3.0 * start)


@kernel
def point(curve: CubicCurve, s: Any) -> Any:
    """Position p(s), x + iy (m), for s in [0, 1]."""
    t = s - 1.0
    return s * s * s * curve.goal - t * t * t * curve.start + curve.alpha * s * s * t + curve.beta * s * t * t


@kernel
def tangent(curve: CubicCurve, s: Any) -> Any:
    """Tangent p'(s) (m), for s in [0, 1]."""
    t = s - 1.0
    ends = 3.0 * s * s * curve.goal - 3.0 * t * t * curve.start
    return ends + curve.alpha * (3.0 * s - 2.0) * s + curve.beta * t * (3.0 * s - 1.0)


@kernel
def tangent_change(curve: CubicCurve, s: Any) -> Any:
    """Second derivative p''(s) (m), for s in [0, 1]; linear in s."""
    ends = 6.0 * s * curve.goal - 6.0 * (s - 1.0) * curve.start
    return ends + curve.alpha * (6.0 * s - 2.0) + curve.beta * (6.0 * s - 4.0)


@kernel
def bend(curve: CubicCurve, s: float) -> tuple[float, float, float]:
    """Return |p'| (m), curvature (1/m) as travelled, and its change per metre travelled (1/m²) at s.

    κ = (p' × p'')/|p'|³, and dκ/ds its derivative by s over |p'|.
    """
    first, second = tangent(curve, s), tangent_change(curve, s)
    third = tangent_change(curve, 1.0) - tangent_change(curve, 0.0)
    square = first.real * first.real + first.imag * first.imag
    turning = first.real * second.imag - first.imag * second.real
    stretching = first.real * second.real + first.imag * second.imag
    twisting = first.real * third.imag - first.imag * third.real
    stretch = math.sqrt(square)
    sharpness = (twisting * square - 3.0 * turning * stretching) / (square * square * square)
    return stretch, turning / (square * stretch), sharpness


class Terms(NamedTuple):
    """Constraints of a drive along a curve.

    Attributes:
        tightest: Maximum curvature (1/m).
        slowest: Minimum |p'| (m).
        rates: (FINE + 1,) s'(τ) of the speed law at equal steps of s; (0,): no law but the limits.
        limits: Limits of drive and plan.
    """

    tightest: float
    slowest: float
    rates: Floats
    limits: Caps


@kernel
def price(curve: CubicCurve, terms: Terms, points: int, longest: float = math.inf) -> float:
    """Seconds along a curve at the maximum speed v that each point allows.

    Without a law ∫ |p'|/v ds, by the trapezium rule; by a law s(τ) the minimum T with |p'|·s'/T ≤ v throughout.

    Args:
        curve: Curve to drive.
        terms: Constraints of the drive.
        points: Number of sampled intervals of s; a divisor of FINE with a law.
        longest: Time (s) beyond which the price does not matter.

    Returns:
        Seconds; infinity if the curve violates the terms, or takes longer.
    """
    seconds, by_law, every = 0.0, len(terms.rates) > 0, FINE // points
    for i in range(points + 1):
        stretch, curvature, sharpness = bend(curve, i / points)
        if not (stretch >= terms.slowest and abs(curvature) <= terms.tightest and seconds <= longest):
            return math.inf
        here = stretch / math.sqrt(square_cap(abs(curvature), abs(sharpness), terms.limits))
        if by_law:
            seconds = max(seconds, here * terms.rates[i * every])
        else:
            seconds += here / points * (0.5 if i == 0 or i == points else 1.0)
    return seconds


@kernel
def quickest_lengths(goal: complex, turn: float, backward: bool, terms: Terms) -> tuple[float, float]:
    """Tangent lengths (k_i, k_f) (m) of the quickest cubic curve from the origin, heading along +x.

    First 8 × 8 factors of the distance, forward and backward, then a compass search about the best, each step along
    k_i, k_f or both (Kolda, Lewis, Torczon, "Optimization by direct search", SIAM Review 45(3), 2003).

    Args:
        goal: x + iy (m).
        turn: Heading at the goal (rad).
        backward: Whether it may be driven backward.
        terms: Constraints of the drive.

    Returns:
        The lengths; NaN twice if no candidate keeps to the terms.
    """
    distance, count = abs(goal), len(FACTORS)
    arriving = complex(math.cos(turn), math.sin(turn))
    rough = np.empty(2 * count * count)
    for i in range(len(rough)):
        sense, k_from, k_to = _tried(i, distance)
        curve = cubic_curve(0j, goal, complex(k_from, 0.0), k_to * arriving)
        allowed = distance > 0.0 and (sense > 0.0 or backward)
        rough[i] = price(curve, terms, ROUGH) if allowed else math.inf
    while True:
        best = 0
        for i in range(1, len(rough)):
            if rough[i] < rough[best] * (1.0 - QUICKER):
                best = i
        if math.isinf(rough[best]):
            return math.nan, math.nan
        _, k_from, k_to = _tried(best, distance)
        curve = cubic_curve(0j, goal, complex(k_from, 0.0), k_to * arriving)
        seconds = price(curve, terms, FINE)
        if seconds < math.inf:
            break
        rough[best] = math.inf
    step = FIRST_STEP
    for _ in range(HALVINGS):
        here_from, here_to = k_from, k_to
        for first, last in ((1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, -1)):
            near_from, near_to = here_from * math.exp(first * step), here_to * math.exp(last * step)
            curve = cubic_curve(0j, goal, complex(near_from, 0.0), near_to * arriving)
            near = price(curve, terms, FINE, seconds)
            if near < seconds * (1.0 - QUICKER):
                seconds, k_from, k_to = near, near_from, near_to
        if k_from == here_from and k_to == here_to:
            step *= 0.5
    return k_from, k_to


@kernel
def _tried(i: int, distance: float) -> tuple[float, float, float]:
    """The i-th candidate: 1 forward or −1 backward, and its tangent lengths (m)."""
    count = len(FACTORS)
    sense = 1.0 if i < count * count else -1.0
    at = i % (count * count)
    return sense, sense * FACTORS[at // count] * distance, sense * FACTORS[at % count] * distance


@kernel
def weights_along(curve: CubicCurve) -> Floats:
    """Cumulative weight (FINE + 1,) of a curve's length, turn and twist at equal steps of s.

    Args:
        curve: Curve, as travelled.
    """
    share = np.empty((FINE, 3))
    for i in range(FINE):
        stretch, curvature, sharpness = bend(curve, (i + 0.5) / FINE)
        share[i] = stretch, stretch * abs(curvature), stretch * abs(sharpness)
    weight = np.zeros(FINE)
    for k in range(3):
        total = share[:, k].sum()
        if total > 0.0:
            weight += share[:, k] / total
    behind = np.zeros(FINE + 1)
    for i in range(FINE):
        behind[i + 1] = behind[i] + weight[i]
    return behind


@kernel
def nearest_curvature(curve: CubicCurve, at: Floats) -> tuple[Floats, Floats]:
    """Least-squares fit of a curve's curvature, continuous and linear in arc length between borders.

    The normal equations of hat functions: Σ_j ∫h_i·h_j ds·κ_j = ∫h_i·κ ds, three to a row, solved by elimination.

    Args:
        curve: Curve, as travelled.
        at: (n + 1,) values of s at the borders.

    Returns:
        (n,) lengths between the borders (m), and (n + 1,) curvatures there (1/m).
    """
    n = len(at) - 1
    length, moment = np.zeros(n), np.zeros(n + 1)
    turned, run = np.empty(len(NODES)), np.empty(len(NODES))
    for i in range(n):
        step = at[i + 1] - at[i]
        for node in range(len(NODES)):
            stretch, bent, _ = bend(curve, at[i] + step * NODES[node])
            run[node] = WEIGHTS[node] * step * stretch
            turned[node] = run[node] * bent
        length[i] = run.sum()
        passed = 0.0
        for node in range(len(NODES)):
            share = (passed + 0.5 * run[node]) / length[i]
            passed += run[node]
            moment[i] += (1.0 - share) * turned[node]
            moment[i + 1] += share * turned[node]
    diagonal = np.zeros(n + 1)
    diagonal[:-1] += length / 3.0
    diagonal[1:] += length / 3.0
    for i in range(n):
        share = length[i] / 6.0 / diagonal[i]
        diagonal[i + 1] -= share * length[i] / 6.0
        moment[i + 1] -= share * moment[i]
    curvature = np.empty(n + 1)
    curvature[n] = moment[n] / diagonal[n]
    for i in range(n - 1, -1, -1):
        curvature[i] = (moment[i] - length[i] / 6.0 * curvature[i + 1]) / diagonal[i]
    return length, curvature


@kernel
def goal_ahead(curve: CubicCurve) -> tuple[complex, float]:
    """End of a curve, x + iy (m), and its total turn (rad), if it leaves the origin along +x.

    Args:
        curve: Curve, as travelled.
    """
    leaving, arriving = tangent(curve, 0.0), tangent(curve, 1.0)
    goal = (curve.goal - curve.start) * leaving.conjugate() / abs(leaving)
    turned = arriving * leaving.conjugate()
    return goal, math.atan2(turned.imag, turned.real)


@kernel
def farthest_off(curve: CubicCurve, at: Floats, length: Floats, curvature: Floats) -> float:
    """Maximum distance (m) of clothoids from the curve at their borders.

    Args:
        curve: Curve that they approximate.
        at: (n + 1,) values of s at the borders.
        length: (n,) lengths (m).
        curvature: (n + 1,) curvature at the borders (1/m).
    """
    leaving = tangent(curve, 0.0)
    position, heading, worst = curve.start, math.atan2(leaving.imag, leaving.real), 0.0
    for i in range(len(length)):
        move, turned_by = _along(length[i], curvature[i], curvature[i + 1])
        position += move * complex(math.cos(heading), math.sin(heading))
        heading += turned_by
        worst = max(worst, abs(position - point(curve, at[i + 1])))
    return worst


@kernel
def miss(length: Floats, curvature: Floats, scale: float, goal: complex, turn: float) -> Floats:
    """Error (3,) (m, m, rad) at the goal of clothoids from the origin along +x.

    Args:
        length: (n,) lengths (m), before scaling.
        curvature: (n + 1,) curvature at their borders (1/m).
        scale: Factor on their lengths.
        goal: x + iy (m).
        turn: Heading there (rad).
    """
    position, heading = 0j, 0.0
    for i in range(len(length)):
        move, turned = _along(length[i] * scale, curvature[i], curvature[i + 1])
        position += move * complex(math.cos(heading), math.sin(heading))
        heading += turned
    off = wrapped(heading - turn)
    return np.array([position.real - goal.real, position.imag - goal.imag, off])


@kernel
def _along(length: float, k_from: float, k_to: float) -> tuple[complex, float]:
    """Displacement (m) and turn (rad) along one clothoid from heading 0, by Gauss-Legendre quadrature."""
    move = 0j
    for node in range(len(NODES)):
        s = NODES[node]
        angle = (k_from + 0.5 * (k_to - k_from) * s) * s * length
        move += WEIGHTS[node] * complex(math.cos(angle), math.sin(angle))
    return move * length, 0.5 * (k_from + k_to) * length
