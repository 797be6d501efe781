"""A roller of which only the tool's way counts, and ways of it."""

import math
from itertools import pairwise
from typing import Literal

import numpy as np

from touchline.schemas.curves import Curve
from touchline.schemas.messages import LinearDirection, Path, Segment, Trajectory
from touchline.schemas.template import Area, Polygon, Template
from touchline.schemas.vehicles import ToolSpec, Vehicle, VehicleBody
from touchline.services.robot_sim.accounting.area_account import AreaAccount
from touchline.services.robot_sim.accounting.area_metrics import area_metrics
from touchline.services.robot_sim.paint.ledger import PaintLedger
from touchline.services.robot_sim.paint.track import Track
from touchline.services.robot_sim.world.body import STEPS, TRACE_SHAPE

WIDTH_M = 2.2
TICK_M = 0.01
BODY = ((0.4, 1.1), (-0.4, 1.1), (-0.4, 0.6), (-2.5, 0.6), (-2.5, -0.6), (-0.4, -0.6), (-0.4, -1.1), (0.4, -1.1))


class Drum(ToolSpec):
    kind: Literal["drum"] = "drum"

    @property
    def point_m(self):
        return 0.0, 0.0

    @property
    def width_m(self):
        return WIDTH_M

    @property
    def covers(self):
        return True


def roller():
    return Vehicle(body=VehicleBody(footprint_m=BODY), tool=Drum())


def field(length_m=20.0, width_m=10.0, **more):
    corners = ((0.0, 0.0), (length_m, 0.0), (length_m, width_m), (0.0, width_m))
    return Template(name="pan", areas=(Area(id="pan", outline=corners),), boundary=Polygon(corners=corners), **more)


class Rolled:
    """Drives a roller's drum along points, one tick each, the body behind it."""

    def __init__(self, template, trajectory=None):
        self.vehicle, self.track, self.tick = roller(), Track(), 0
        self.ledger = PaintLedger([], 0.12, WIDTH_M)
        self.account = AreaAccount(template, trajectory or Trajectory(), self.vehicle)

    def along(self, points, *, backward=False, stop=True):
        """Roll along points (n, 2), and stand then."""
        trace = np.zeros(TRACE_SHAPE)
        for before, after in pairwise(points):
            trace[:, :2] = np.linspace(before, after, STEPS + 1)
            trace[1:, 2] = 1.0
            self._enter(trace, math.atan2(*(after - before)[::-1]) + (math.pi if backward else 0.0))
        if stop:
            trace[:, :2], trace[:, 2] = points[-1], 0.0
            self._enter(trace, math.nan)
        return self

    def _enter(self, trace, heading_rad):
        self.tick += 1
        self.ledger.record(trace)
        if not math.isnan(heading_rad):
            self.track.enter(self.tick, (*trace[-1, :2].tolist(), heading_rad), self.ledger.points)

    def standing(self):
        self.account.take(self.ledger)
        return self.account.standing

    def metrics(self):
        return area_metrics(self.account, self.ledger, self.track)


def line(start, end, step_m=TICK_M):
    count = max(1, math.ceil(math.dist(start, end) / step_m - 1e-9))
    return np.linspace(start, end, count + 1)


def bend(x_m, y_m, heading_rad, curvature_1pm, length_m):
    x, y, _, _ = Curve(x_m, y_m, heading_rad, curvature_1pm, length_m).at(
        np.linspace(0.0, length_m, math.ceil(length_m / TICK_M) + 1)
    )
    return np.column_stack((x, y))


def path_of(*curves, direction=LinearDirection.FORWARD):
    segments = [
        Segment(id=str(k), curve=curve.to_message(), direction=LinearDirection(value=direction))
        for k, curve in enumerate(curves)
    ]
    return Trajectory(path=Path(segments=tuple(segments)))
