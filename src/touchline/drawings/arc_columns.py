"""Lines and arcs by the thousand, as columns: biarcs, arcs by the tangent at an end, and distances of points.

A biarc is two arcs that leave the first point with its tangent, arrive at the last with its tangent, and meet with a
common one (Bolton 1975, here with legs of equal length). Points and unit tangents are complex numbers, x + iy.
"""

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from touchline.drawings.outline import Floats
from touchline.schemas.curves import Curve

Complexes: TypeAlias = npt.NDArray[np.complex128]
Bools: TypeAlias = npt.NDArray[np.bool_]

#: Columns of a curve: x, y (m), heading (rad), curvature (1/m), length (m).
COLUMNS = 5
#: A piece that turns by less is a straight line to every onboard computer; points closer than this (m) coincide.
STRAIGHT_RAD, COINCIDENT_M = 1e-9, 1e-11
#: Maximum turn of an arc of a biarc.
STEEPEST_RAD = np.pi


def columns(curves: list[Curve]) -> Floats:
    """Convert curves to columns (n, 5)."""
    rows = [(c.x_m, c.y_m, c.heading_rad, c.curvature_1pm, c.length_m) for c in curves]
    return np.array(rows, dtype=np.float64).reshape(-1, COLUMNS)


def curves_of(rows: Floats) -> list[Curve]:
    """Convert columns (…, 5) to curves, without those of no length."""
    return [Curve(*row) for row in rows.reshape(-1, COLUMNS).tolist() if row[-1] > 0.0]


def biarcs(start: Complexes, leave: Complexes, end: Complexes, arrive: Complexes) -> tuple[Floats, Bools]:
    """Two arcs each (n, 2, 5) (for a line the second has no length), and whether a forward biarc exists (n,).

    With legs of equal length d: |v|² − 2d v·(t₀ + t₁) − 2d²(1 − t₀·t₁) = 0, where v joins the ends.

    Args:
        start: (n,) start points (m).
        leave: (n,) unit tangents there.
        end: (n,) end points (m).
        arrive: (n,) unit tangents there.
    """
    v = end - start
    a = 2.0 * (1.0 - (leave * arrive.conj()).real)
    b = 2.0 * (v * (leave + arrive).conj()).real
    square = np.abs(v) ** 2
    sum_ = b + np.sqrt(b * b + 4.0 * a * square)
    leg = 2.0 * square / np.where(sum_ > 0.0, sum_, 1.0)
    joint = (start + end + leg * (leave - arrive)) / 2.0
    first, second = leaving(start, leave, joint), arriving(joint, end, arrive)
    turns = np.abs(first[:, 3] * first[:, 4]), np.abs(second[:, 3] * second[:, 4])
    good = (sum_ > 0.0) & (np.maximum(*turns) <= STEEPEST_RAD + STRAIGHT_RAD)
    good &= np.minimum(first[:, 4], second[:, 4]) > COINCIDENT_M
    straight = good & (np.maximum(*turns) < STRAIGHT_RAD)
    found = np.stack((first, second), axis=1)
    found[straight, 0] = lines(start, end)[straight]
    found[straight, 1, 4] = 0.0
    return found, good


def lines(start: Complexes, end: Complexes) -> Floats:
    """Lines (n, 5) between points (n,)."""
    v = end - start
    return np.column_stack((start.real, start.imag, np.angle(v), np.zeros(len(v)), np.abs(v)))


def leaving(start: Complexes, leave: Complexes, end: Complexes) -> Floats:
    """Arcs (n, 5) that leave ``start`` along ``leave`` and pass ``end``."""
    return _bent(start, end - start, np.angle((end - start) * leave.conj()))


def arriving(start: Complexes, end: Complexes, arrive: Complexes) -> Floats:
    """Arcs (n, 5) from ``start`` that arrive at ``end`` along ``arrive``."""
    return _bent(start, end - start, np.angle(arrive * (end - start).conj()))


def through(start: Complexes, middle: Complexes, end: Complexes) -> Floats:
    """Arcs (n, 5) from ``start`` to ``end`` that pass ``middle``."""
    # The angles at the circle are half of those at its centre.
    half_turn = np.angle((end - middle) * (middle - start).conj())
    return _bent(start, end - start, half_turn)


def _bent(start: Complexes, chord: Complexes, half_turn: Floats) -> Floats:
    reach = np.abs(chord)
    flat = np.abs(half_turn) < STRAIGHT_RAD / 2
    length = reach / np.sinc(half_turn / np.pi)
    curvature = np.where(flat, 0.0, 2.0 * half_turn / np.where(length > 0.0, length, 1.0))
    heading = np.angle(chord) - np.where(flat, 0.0, half_turn)
    return np.column_stack((start.real, start.imag, heading, curvature, np.where(flat, reach, length)))


def distances(points: Complexes, rows: Floats) -> Floats:
    """Distances (m) of points (…) from lines and arcs (…, 5), of shapes that broadcast."""
    x, y, heading, curvature, length = (rows[..., k] for k in range(COLUMNS))
    local = (points - (x + 1j * y)) * np.exp(-1j * heading)
    along, left = local.real, local.imag
    straight = np.hypot(along - np.clip(along, 0.0, length), left)
    bent = curvature != 0.0
    if not bent.any():
        return np.asarray(straight)
    radius, sign = 1.0 / np.where(bent, np.abs(curvature), 1.0), np.sign(curvature)
    turned = np.arctan2(along, radius - sign * left) % (2 * np.pi)
    total = length / radius
    # Beyond the arc's ends the nearer end is the nearest point.
    nearest = np.where(turned <= total, turned, np.where(turned - total < 2 * np.pi - turned, total, 0.0))
    arc = np.hypot(along - radius * np.sin(nearest), sign * left - radius * (1.0 - np.cos(nearest)))
    return np.asarray(np.where(bent, arc, straight))
