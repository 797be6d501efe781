"""Smears: crossings of wet paint by wheels and casters, and their prints beside the lines."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.robust_overlay import difference, union
from touchline.onboard.interface import TICK_S
from touchline.schemas.vehicles import GroundContact, Vehicle
from touchline.services.robot_sim.paint import contact as c
from touchline.services.robot_sim.paint import track as t
from touchline.services.robot_sim.paint.cell_grid import Grid, grid_of_boxes
from touchline.services.robot_sim.paint.ledger import PaintLedger
from touchline.services.robot_sim.paint.paint_areas import band_of, simplified, strip
from touchline.services.robot_sim.paint.targets import Target

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

_POINTS_A_PIECE: Final = 5
"""Number of points of the straight pieces into which paint is divided: some 5 cm."""
_SMALLEST_CELL_M: Final = 0.25
_MOST_CELLS: Final = 1 << 18
_ROOM: Final = 1 << 14
_BREAK_M: Final = 1.5 * c.CELL_M
_SAME_STRENGTH: Final = 0.1
_SIMPLIFIED_M: Final = 1e-3

Floats = NDArray[np.float64]


class SmearPrint(NamedTuple):
    """One print of a tread."""

    line: int
    """Index of the line that the paint is from, −1 for none."""
    age_s: float
    """Age of the youngest paint in it when it was taken up."""
    strength: float
    """Share of a fresh line's paint."""
    width_m: float
    points: Floats
    """Middle of the tread [m], (n, 2)."""


class Smearing(NamedTuple):
    """Effects of wheels and casters on wet paint; the lines are assumed to stay covered."""

    crossings: int
    """Number of encounters of a wheel or caster with wet paint of a line."""
    youngest_s: float
    """Age of the freshest paint that was met; 0 without any."""
    area_m2: float
    """Area of prints outside the lines' bands."""
    smears: list[SmearPrint]


def smearing(ledger: PaintLedger, track: t.Track, vehicle: Vehicle) -> Smearing:
    """Follow every wheel and caster over the paint; takes a moment, so it is done once at the end.

    Args:
        ledger: The paint; paint from before the track began counts as dry.
        track: True path of the robot.
        vehicle: Gives the contacts, and the drying time of the paint.
    """
    rows, paint = track.rows, _pieces(ledger, track.rows)
    if not len(paint) or not vehicle.tool.paints:  # rolled ground does not stick to wheels
        return Smearing(0, 0.0, 0.0, [])
    tool, left_m = vehicle.tool, np.zeros(len(ledger.targets) + 1)
    wet = c.WetPaint(paint, _grid(paint), tool.drying_time_s, tool.smear_share, tool.smear_length_m)
    crossings, youngest_s, smears, prints = 0, math.inf, list[SmearPrint](), np.zeros((_ROOM, c.PRINT_COLUMNS))
    for contact in vehicle.drive.contacts:
        path, tread = _path(rows, contact), c.Tread(contact.swivels, 2.0 * math.pi * contact.radius_m)
        while True:
            found = c.roll(path, tread, wet, left_m, prints)
            if found[1] <= len(prints):
                break
            prints = np.zeros((2 * found[1], c.PRINT_COLUMNS))
        crossings, youngest_s = crossings + found[0], min(youngest_s, found[2])
        smears += _smears(prints[: found[1]], contact.width_m)
    area_m2 = _outside(smears, ledger.targets, ledger.line_width_m)
    return Smearing(crossings, youngest_s if crossings else 0.0, area_m2, smears)


class Painter(NamedTuple):
    """Paint of a robot, and its poses meanwhile; the track's clock is shared by all robots."""

    ledger: PaintLedger
    track: t.Track


def wet_crossings_of(painters: Sequence[Painter], vehicle: Vehicle) -> int:
    """Count the encounters of wheels and casters of any robot with wet paint of any robot.

    Args:
        painters: All robots.
        vehicle: Vehicle of every robot.
    """
    pieces, numbers = list[Floats](), dict[str, int]()
    for painter in painters:
        rows = _pieces(painter.ledger, painter.track.rows)
        ids = [numbers.setdefault(name, len(numbers)) for name in painter.ledger.ids]
        rows[:, c.LINE] = np.array([*ids, -1])[rows[:, c.LINE].astype(np.int64)]
        pieces.append(rows)
    paint = np.concatenate(pieces)
    if not len(paint) or not vehicle.tool.paints:
        return 0
    tool, left_m = vehicle.tool, np.zeros(len(numbers) + 1)
    wet = c.WetPaint(paint, _grid(paint), tool.drying_time_s, 0.0, tool.smear_length_m)
    crossings = 0
    for painter in painters:
        for contact in vehicle.drive.contacts:
            path, tread = _path(painter.track.rows, contact), c.Tread(contact.swivels, 2.0 * math.pi * contact.radius_m)
            crossings += c.roll(path, tread, wet, left_m, np.zeros((0, c.PRINT_COLUMNS)))[0]
    return crossings


def _path(rows: Floats, contact: GroundContact) -> Floats:
    """Return the path (n, contact.PATH_COLUMNS) of a contact."""
    cos, sin = np.cos(rows[:, t.TRACK_HEADING]), np.sin(rows[:, t.TRACK_HEADING])
    x = rows[:, t.TRACK_EAST] + cos * contact.x_m - sin * contact.y_m
    y = rows[:, t.TRACK_NORTH] + sin * contact.x_m + cos * contact.y_m
    return np.column_stack((TICK_S * rows[:, t.TRACK_TICK], x, y, cos, sin))


def _pieces(ledger: PaintLedger, rows: Floats) -> Floats:
    """Return the paint (n, contact.PAINT_COLUMNS) whose time of laying is known."""
    laid_s, found = _laid_s(ledger.points, rows), list[Floats]()
    for marks in ledger.all_marks():
        last = len(marks.x_m) - 1
        at = np.append(np.arange(0, last, _POINTS_A_PIECE), last)
        x, y, laid = marks.x_m[at], marks.y_m[at], laid_s[marks.first_index + at]
        half, line = np.full(len(at) - 1, 0.5 * marks.width_m), np.full(len(at) - 1, float(marks.target))
        found.append(np.column_stack((x[:-1], y[:-1], x[1:], y[1:], laid[:-1], laid[1:], half, line)))
    pieces = np.concatenate(found) if found else np.zeros((0, c.PAINT_COLUMNS))
    moved = np.hypot(pieces[:, c.X1] - pieces[:, c.X0], pieces[:, c.Y1] - pieces[:, c.Y0]) > 0.0
    return np.ascontiguousarray(pieces[moved & (pieces[:, c.LAID_FROM] >= 0.0)])


def _laid_s(points: int, rows: Floats) -> Floats:
    """Return the time at which each of so many points of paint was laid; −1 if before the track."""
    if not len(rows):
        return np.full(points, -1.0)
    index, lay, time_s = np.arange(points), rows[:, t.TRACK_POINTS], TICK_S * rows[:, t.TRACK_TICK]
    after = np.searchsorted(lay, index, side="right")
    known, to = after > 0, np.minimum(after, len(rows) - 1)
    before = np.maximum(to - 1, 0)
    share = np.clip((index + 1 - lay[before]) / np.maximum(lay[to] - lay[before], 1.0), 0.0, 1.0)
    return np.where(known, time_s[before] + share * (time_s[to] - time_s[before]), -1.0)


def _grid(paint: Floats) -> Grid:
    """Make the grid of the pieces of paint."""
    half = paint[:, c.HALF_WIDTH, None]
    low = np.minimum(paint[:, [c.X0, c.Y0]], paint[:, [c.X1, c.Y1]]) - half
    high = np.maximum(paint[:, [c.X0, c.Y0]], paint[:, [c.X1, c.Y1]]) + half
    return grid_of_boxes(low, high, _SMALLEST_CELL_M, _MOST_CELLS)


def _smears(prints: Floats, width_m: float) -> Iterator[SmearPrint]:
    """Join consecutive prints of one contact."""
    if not len(prints):
        return
    strength, line = prints[:, c.STRENGTH], prints[:, c.PRINT_LINE]
    apart = np.diff(prints[:, c.PRINT_AT]) > _BREAK_M
    other = np.abs(np.diff(strength)) > _SAME_STRENGTH * strength[:-1]
    for run in np.split(prints, np.flatnonzero(apart | other | (np.diff(line) != 0.0)) + 1):
        points = np.vstack((run[0, [c.X0, c.Y0]], run[:, [c.X1, c.Y1]]))
        age_s, mean = float(run[:, c.AGE].min()), float(run[:, c.STRENGTH].mean())
        yield SmearPrint(int(run[0, c.PRINT_LINE]), age_s, mean, width_m, simplified(points, _SIMPLIFIED_M))


def _outside(smears: Sequence[SmearPrint], targets: Sequence[Target], line_width_m: float) -> float:
    """Compute the area [m²] of prints outside all lines' bands."""
    if not smears:
        return 0.0
    prints = union([strip(smear.points, smear.width_m) for smear in smears])
    bands: list[BaseGeometry] = [band_of(target.curve, line_width_m) for target in targets]
    near = [band for band in bands if band.intersects(prints)]
    return float(difference(prints, union(near)).area)
