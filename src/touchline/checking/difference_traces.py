"""Series drawn of a session that differs: paths, errors, and the field that differs first."""

from __future__ import annotations

import math
import re
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.checking.divergence import Divergence, stamp_ns
from touchline.recordings.recorder import is_stamped
from touchline.schemas import topics
from touchline.schemas.cdr import decode
from touchline.schemas.curves import Curve
from touchline.schemas.errors import PayloadError
from touchline.schemas.messages import Trajectory
from touchline.schemas.topics import Topic
from touchline.services.robot_sim.packing import Payload

Floats = NDArray[np.float64]

WINDOW_S: Final = 4.0
"""Sim time before and after the first difference in which the field is drawn in full."""
MOST_POINTS: Final = 1200
"""Most points of a line over the whole session."""
INNOVATIONS: Final = ("innovation_east_m", "innovation_north_m")
_STEP: Final = re.compile(r"([^.\[\]]+)|\[(\d+)\]")
_PLAN_STEP_M: Final = 0.5
_UNKNOWN_M2: Final = 1e3
"""Variance of a position that is not known yet."""


class TimeSeries(NamedTuple):
    """Values of one side.

    Attributes:
        time_s: (n,) sim time, increasing.
        values: (n,) or (n, 2).
    """

    time_s: Floats
    values: Floats


class BothSides(NamedTuple):
    """The same series of both sessions."""

    recorded: TimeSeries
    today: TimeSeries


@dataclass
class DifferenceTraces:
    """Collects series from the messages of both sessions.

    Attributes:
        first: The first difference.
        length_s: Length of the session (sim time).
    """

    first: Divergence
    length_s: float
    _found: dict[tuple[str, int], dict[int, Any]] = field(default_factory=lambda: defaultdict(dict))

    def take(self, side: int, messages: Iterable[Payload]) -> None:
        """Take messages and keep the values to draw; side 0 is the recording, 1 the present run."""
        every_ns = max(round(self.length_s / MOST_POINTS * 10.0), 1) * 100_000_000
        for topic, payload in messages:
            if not is_stamped(topic):
                continue
            at_ns = stamp_ns(payload)
            if topic in (topics.TRUTH, topics.ODOMETRY) and at_ns % every_ns == 0:
                self._keep("position", topic, side, at_ns, payload)
            elif topic == topics.STATUS and at_ns % every_ns == 0:
                self._keep("lateral_error_m", topic, side, at_ns, payload)
            elif topic == topics.ESTIMATOR and at_ns % every_ns == 0:
                for name in ("fix_nis_recent", *INNOVATIONS):
                    self._keep(name, topic, side, at_ns, payload)
            if topic.name == self.first.topic and abs(at_ns / 1e9 - self.first.time_s) <= WINDOW_S:
                self._keep(self.first.field, topic, side, at_ns, payload)

    def _keep(self, what: str, topic: Topic, side: int, at_ns: int, payload: bytes) -> None:
        try:
            message = decode(topic.type, payload)
        except PayloadError:  # of another version
            return
        if what == "position":
            pose = message.pose  # type: ignore[attr-defined]
            if pose.covariance[0] < _UNKNOWN_M2:
                self._found[topic.name, side][at_ns] = (pose.pose.position.x, pose.pose.position.y)
        elif (value := _number_at(message, what)) is not None:
            self._found[what, side][at_ns] = value

    @property
    def paths(self) -> BothSides:
        """True paths of the robots (m, map frame); without truth, the believed ones."""
        truth = self._pair(topics.TRUTH.name)
        return truth if len(truth.recorded.time_s) else self._pair(topics.ODOMETRY.name)

    @property
    def apart(self) -> TimeSeries:
        """Distance between the robots at the same sim time (m)."""
        paths = self.paths
        return _distance(paths.recorded, paths.today)

    @property
    def lateral(self) -> BothSides:
        """Believed cross-track errors, left positive (m)."""
        return self._pair("lateral_error_m")

    @property
    def estimate_error(self) -> BothSides:
        """Errors of the position estimates (m)."""
        both = [
            _distance(self._series(topics.TRUTH.name, side), self._series(topics.ODOMETRY.name, side))
            for side in (0, 1)
        ]
        return BothSides(*both)

    @property
    def estimates_apart(self) -> TimeSeries:
        """Distance between both estimates at the same sim time (m)."""
        return _distance(*self._pair(topics.ODOMETRY.name))

    def consistency(self, field: str) -> BothSides:
        """Return a field of the estimators' consistency reports."""
        return self._pair(field)

    @property
    def field(self) -> BothSides:
        """The field that differs first, around that time."""
        return self._pair(self.first.field)

    def _pair(self, what: str) -> BothSides:
        return BothSides(self._series(what, 0), self._series(what, 1))

    def _series(self, what: str, side: int) -> TimeSeries:
        found = self._found[what, side]
        at_ns = sorted(found)
        return TimeSeries(np.array(at_ns, float) / 1e9, np.array([found[each] for each in at_ns], float))


def difference(pair: BothSides) -> TimeSeries:
    """Return the present values minus the recorded ones, where both exist."""
    common, left, right = np.intersect1d(pair.recorded.time_s, pair.today.time_s, return_indices=True)
    return TimeSeries(common, pair.today.values[right] - pair.recorded.values[left])


def _distance(one: TimeSeries, other: TimeSeries) -> TimeSeries:
    if not len(one.time_s) or not len(other.time_s):
        return TimeSeries(np.zeros(0), np.zeros(0))
    apart = difference(BothSides(one, other))
    return TimeSeries(apart.time_s, np.hypot(*apart.values.T))


def _number_at(message: object, path: str) -> float | None:
    """Return the number at a path such as ``pose.position.x`` or ``x_m[3]``; None if there is none."""
    found: Any = message
    for name, number in _STEP.findall(path):
        try:
            found = getattr(found, name) if name else found[int(number)]
        except (AttributeError, IndexError, TypeError):
            return None
    number_types = (int, float, np.number)
    return float(found) if isinstance(found, number_types) and math.isfinite(found) else None


def way_of(trajectory: Trajectory) -> Floats:
    """Return (n, 2) points along a plan (m, map frame)."""
    points = [np.zeros((0, 2))]
    for segment in trajectory.path.segments:
        curve = Curve.from_message(segment.curve)
        stations = np.linspace(0.0, curve.length_m, 2 + int(curve.length_m / _PLAN_STEP_M))
        x, y, *_ = curve.at(stations)
        points.append(np.column_stack((x, y)))
    return np.vstack(points)
