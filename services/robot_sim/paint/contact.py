"""A wheel or caster that rolls over wet paint: what its tread takes up, and where it prints that again."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.services.core.jit import kernel
from touchline.services.robot_sim.paint.cell_grid import cell_of

CELL_M: Final = 0.005
"""The tread and the way are looked at in pieces no longer than this."""
FAINTEST: Final = 0.05
"""Prints with a smaller share of a line's paint are not seen."""
_SAME_CROSSING_M: Final = 0.03
"""Who is off a line for less has not left it: paint has pores between one piece and the next."""

# Columns of a contact's way.
TIME: Final = 0  # s
X: Final = 1
Y: Final = 2
FORWARD_X: Final = 3  # unit vector of the robot's heading
FORWARD_Y: Final = 4
WAY_COLUMNS: Final = 5

# Columns of pieces of paint: straight strips.
X0: Final = 0
Y0: Final = 1
X1: Final = 2
Y1: Final = 3
LAID_FROM: Final = 4  # s
LAID_TO: Final = 5
HALF_WIDTH: Final = 6
LINE: Final = 7  # index of the line that it belongs to, −1 for none
PAINT_COLUMNS: Final = 8

# Columns of prints, after the `X0`…`Y1` of a piece of the contact's way.
STRENGTH: Final = 4  # share of a fresh line's paint
PRINT_LINE: Final = 5  # the line that it is from
AGE: Final = 6  # of that paint when it was taken up [s]
PRINT_AT: Final = 7  # way rolled so far [m]
PRINT_COLUMNS: Final = 8

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


@kernel
def roll(
    way: Floats,
    swivels: bool,
    circumference_m: float,
    paint: Floats,
    grid: tuple[Floats, Integers, Integers],
    wet: tuple[float, float, float],
    left_m: Floats,
    prints: Floats,
) -> tuple[int, int, float]:
    """Roll along a way; returns (crossings, prints, age of the youngest paint met [s]).

    A crossing is that the middle of the contact comes upon wet paint of a line. There the tread takes up the share
    `taken` of the paint, less as that dries, none once it is dry. Each time that the piece of tread comes round again
    it prints on the ground, with what exp(−way/`fade_m`) has left of it.

    Args:
        way: (n, WAY_COLUMNS).
        swivels: Whether it always rolls forward, as a caster does.
        circumference_m: Of the tread.
        paint: (n, PAINT_COLUMNS).
        grid: Frame as of `Grid`; where each cell's list begins; the lists of pieces of `paint` that reach into it.
        wet: How long paint stays wet [s]; `taken`; `fade_m`.
        left_m: (lines + 1,) scratch.
        prints: (n, PRINT_COLUMNS) filled as far as there is room: more may be returned than that.
    """
    frame, starts, members = grid
    drying_s, taken, fade_m = wet
    pieces = max(1, math.floor(circumference_m / CELL_M + 0.5))
    piece_m = circumference_m / pieces
    load, loaded_at = np.zeros(pieces), np.zeros(pieces)
    load_line, load_age = np.zeros(pieces), np.zeros(pieces)
    left_m[:] = -math.inf
    crossings = count = 0
    youngest = math.inf
    rolled = at = 0.0
    for row in range(1, len(way)):
        ax, ay = way[row - 1, X], way[row - 1, Y]
        dx, dy = way[row, X] - ax, way[row, Y] - ay
        distance = math.hypot(dx, dy)
        if distance == 0.0:
            continue
        back = not swivels and dx * way[row, FORWARD_X] + dy * way[row, FORWARD_Y] < 0.0
        steps = math.ceil(distance / piece_m)
        step = distance / steps
        for k in range(1, steps + 1):
            share = k / steps
            x, y = ax + share * dx, ay + share * dy
            time = way[row - 1, TIME] + share * (way[row, TIME] - way[row - 1, TIME])
            at += step
            rolled += -step if back else step
            piece = math.floor(rolled / piece_m) % pieces
            age, line = math.inf, -1
            cell = cell_of(x, y, frame)
            for member in range(starts[cell] if cell >= 0 else 0, starts[cell + 1] if cell >= 0 else 0):
                strip = paint[members[member]]
                if strip[LAID_FROM] > time or strip[LAID_TO] < time - drying_s:
                    continue
                ex, ey = strip[X1] - strip[X0], strip[Y1] - strip[Y0]
                length = math.hypot(ex, ey)
                px, py = x - strip[X0], y - strip[Y0]
                s, aside = (px * ex + py * ey) / length, (py * ex - px * ey) / length
                if s < 0.0 or s > length or abs(aside) > strip[HALF_WIDTH]:
                    continue
                since = time - strip[LAID_FROM] - s / length * (strip[LAID_TO] - strip[LAID_FROM])
                if since < 0.0 or since > drying_s:
                    continue
                index = int(strip[LINE])
                if at - left_m[index] > _SAME_CROSSING_M:
                    crossings += 1
                left_m[index] = at
                if since < age:
                    age, line = since, index
            if age < math.inf:
                youngest = min(youngest, age)
                load[piece], loaded_at[piece] = taken * (1.0 - age / drying_s), at
                load_line[piece], load_age[piece] = line, age
            elif load[piece] > 0.0 and at - loaded_at[piece] > 2.0 * piece_m:
                strength = load[piece] * math.exp((loaded_at[piece] - at) / fade_m)
                if strength < FAINTEST:
                    load[piece] = 0.0
                    continue
                if count < len(prints):
                    out = prints[count]
                    out[X0], out[Y0] = x - dx / steps, y - dy / steps
                    out[X1], out[Y1] = x, y
                    out[STRENGTH], out[PRINT_LINE] = strength, load_line[piece]
                    out[AGE], out[PRINT_AT] = load_age[piece], at
                count += 1
    return crossings, count, youngest
