"""Lines, and paint along and beside them, for cases worked out by hand."""

import math

import numpy as np

from touchline.schemas.curves import Curve
from touchline.services.robot_sim.paint.ledger import PaintLedger
from touchline.services.robot_sim.paint.targets import Target
from touchline.services.robot_sim.world.body import STEPS, TRACE_SHAPE

WIDTH = 0.12
NORTHWARD = Curve.from_line((0.0, 0.0), (0.0, 10.0))
EASTWARD = Curve.from_line((0.0, 0.0), (10.0, 0.0))


def ledger_of(*curves):
    return PaintLedger([Target(f"s{i}", curve) for i, curve in enumerate(curves)], WIDTH, WIDTH)


def paint(ledger, points):
    """Spray along a polyline of points 1 ms apart, (n, 2), with the valve closed before and after."""
    points = np.asarray(points, dtype=float)
    rows = np.column_stack((points, np.ones(len(points))))
    rows[0, 2] = 0.0
    pad = -(len(rows) - 1) % STEPS
    rows = np.vstack((rows, [[*points[-1], 0.0]] * (pad + STEPS)))
    for first in range(0, len(rows) - STEPS, STEPS):
        trace = rows[first : first + STEPS + 1].copy()
        assert trace.shape == TRACE_SHAPE
        ledger.record(trace)
    return ledger


def line(start, end, step=0.001):
    count = max(2, round(math.dist(start, end) / step) + 1)
    return np.column_stack((np.linspace(start[0], end[0], count), np.linspace(start[1], end[1], count)))


def along(curve, first=0.0, last=None, left=0.0):
    """Points every millimetre along a curve, `left` of it."""
    last = curve.length_m if last is None else last
    x, y, heading, _ = curve.at(np.linspace(first, last, round((last - first) / 0.001) + 1))
    return np.column_stack((x - left * np.sin(heading), y + left * np.cos(heading)))
