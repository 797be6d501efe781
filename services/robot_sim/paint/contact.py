"""Contact of a wheel or caster with wet paint: its tread takes paint up and prints it elsewhere."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel
from touchline.services.robot_sim.paint.cell_grid import Grid, cell_of

CELL_M: Final = 0.005
"""Largest length of the pieces into which tread and path are divided."""
FAINTEST: Final = 0.05
"""Share of a line's paint below which prints are not visible."""
_SAME_CROSSING_M: Final = 0.03
"""Distance off a line up to which a contact has not left it: paint has pores between one piece and the next."""

# Columns of a contact's path.
TIME: Final = 0  # s
X: Final = 1
Y: Final = 2
FORWARD_X: Final = 3  # unit vector of the robot's heading
FORWARD_Y: Final = 4
PATH_COLUMNS: Final = 5

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

# Columns of prints, after the `X0`…`Y1` of a piece of the contact's path.
STRENGTH: Final = 4  # share of a fresh line's paint
PRINT_LINE: Final = 5  # line that the paint is from
AGE: Final = 6  # age of the paint when it was taken up [s]
PRINT_AT: Final = 7  # distance rolled so far [m]
PRINT_COLUMNS: Final = 8

Floats = NDArray[np.float64]


class Tread(NamedTuple):
    """Tread that touches the ground."""

    swivels: bool
    """True if it always rolls forward, as a caster does."""
    circumference_m: float


class WetPaint(NamedTuple):
    """Wet paint on the ground."""

    strips: Floats
    """Strips of paint, (n, PAINT_COLUMNS)."""
    grid: Grid
    """Grid of the strips."""
    drying_s: float
    """Time for which paint stays wet."""
    taken: float
    """Share of a line's paint that a tread takes up while it is fresh."""
    fade_m: float
    """Distance over which prints fade by a factor of e."""


@kernel
def roll(path: Floats, tread: Tread, paint: WetPaint, left_m: Floats, prints: Floats) -> tuple[int, int, float]:
    """Roll a contact along a path.

    A crossing is an encounter of the contact's middle with wet paint of a line. There the tread takes up the share
    `taken` of the paint, less as that dries, none once it is dry. Each time that the piece of tread comes round again
    it prints on the ground, with the share exp(−distance/`fade_m`) of it: a rule of this project's own.

    Args:
        path: (n, PATH_COLUMNS) path of the contact's middle, map frame.
        tread: Tread that rolls.
        paint: Paint on the ground.
        left_m: (lines + 1,) scratch.
        prints: (n, PRINT_COLUMNS) filled as far as there is room: the returned number may be larger.

    Returns:
        Crossings, prints, age of the youngest paint met [s].
    """
    frame, starts, members = paint.grid.frame, paint.grid.starts, paint.grid.members
    drying_s, taken, fade_m = paint.drying_s, paint.taken, paint.fade_m
    pieces = max(1, math.floor(tread.circumference_m / CELL_M + 0.5))
    piece_m = tread.circumference_m / pieces
    load, loaded_at = np.zeros(pieces), np.zeros(pieces)
    load_line, load_age = np.zeros(pieces), np.zeros(pieces)
    left_m[:] = -math.inf
    crossings = count = 0
    youngest = math.inf
    rolled = at = 0.0
    for row in range(1, len(path)):
        ax, ay = path[row - 1, X], path[row - 1, Y]
        dx, dy = path[row, X] - ax, path[row, Y] - ay
        distance = math.hypot(dx, dy)
        if distance == 0.0:
            continue
        back = not tread.swivels and dx * path[row, FORWARD_X] + dy * path[row, FORWARD_Y] < 0.0
        steps = math.ceil(distance / piece_m)
        step = distance / steps
        for k in range(1, steps + 1):
            share = k / steps
            x, y = ax + share * dx, ay + share * dy
            time = path[row - 1, TIME] + share * (path[row, TIME] - path[row - 1, TIME])
            at += step
            rolled += -step if back else step
            piece = math.floor(rolled / piece_m) % pieces
            age, line = math.inf, -1
            cell = cell_of(x, y, frame)
            for member in range(starts[cell] if cell >= 0 else 0, starts[cell + 1] if cell >= 0 else 0):
                strip = paint.strips[members[member]]
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
