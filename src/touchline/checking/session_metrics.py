"""Main figures of a session, recorded and now."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

from touchline.recordings.units import unit_of
from touchline.schemas import topics
from touchline.schemas.cdr import decode
from touchline.schemas.errors import PayloadError
from touchline.schemas.messages import TraversalReport, TraversalStatus
from touchline.schemas.topics import Topic

_OF_REPORT: Final = (
    ("duration", "total_time_s"),
    ("coverage", "coverage_pct"),
    ("mean error", "lateral_error_mean_m"),
    ("p95 error", "lateral_error_p95_m"),
    ("estimate RMSE", "position_rmse_m"),
)
_DIGITS: Final = (2, 3, 4, 6)
"""Numbers of decimals."""
_KEPT: Final = (topics.REPORT.name, topics.STATUS.name)
_OF_STATUS: Final = (("duration", "elapsed_s"), ("coverage", "coverage_pct"))


class SessionMetric(NamedTuple):
    """A figure of a session.

    Attributes:
        name: Name of the figure.
        unit: Unit of both.
        recorded, today: None where that session has none.
    """

    name: str
    unit: str
    recorded: float | None
    today: float | None

    @property
    def same(self) -> bool:
        """True if both are the same to the bit."""
        return self.recorded == self.today

    def __str__(self) -> str:
        """Return both values with enough digits to distinguish them, or the common one; lengths in mm."""
        scale, unit = (1000.0, "mm") if self.unit == "m" else (1.0, self.unit)
        both = [None if value is None else scale * value for value in (self.recorded, self.today)]
        for digits in _DIGITS:
            texts = ["none" if value is None else f"{value:.{digits}f}" for value in both]
            if self.same:
                return f"{texts[0]} {unit}"
            if texts[0] != texts[1]:
                return f"{' → '.join(texts)} {unit}"
        return f"{self.recorded!r} → {self.today!r} {self.unit}"


class MetricKeeper:
    """Collector of the metrics' sources: the last report and the last status of both sessions."""

    def __init__(self) -> None:
        """Start empty."""
        self._last: dict[tuple[str, int], bytes] = {}

    def take(self, topic: Topic, side: int, payload: bytes) -> None:
        """Take a message; side 0 is the recording, 1 the present run."""
        if topic.name in _KEPT:
            self._last[topic.name, side] = payload

    @property
    def metrics(self) -> tuple[SessionMetric, ...]:
        """Return the metrics of the final reports; without one, as the robots believed at the end."""
        reports = [self._read(TraversalReport, topics.REPORT, side) for side in (0, 1)]
        if all(each is not None for each in reports):
            return _metrics(_OF_REPORT, reports)
        statuses = [self._read(TraversalStatus, topics.STATUS, side) for side in (0, 1)]
        return _metrics(_OF_STATUS, statuses) if any(each is not None for each in statuses) else ()

    def _read(
        self, kind: type[TraversalReport] | type[TraversalStatus], topic: Topic, side: int
    ) -> TraversalReport | TraversalStatus | None:
        payload = self._last.get((topic.name, side))
        try:
            return None if payload is None else decode(kind, payload)
        except PayloadError:  # of another version
            return None


def _metrics(
    fields: Sequence[tuple[str, str]], both: Sequence[TraversalReport | TraversalStatus | None]
) -> tuple[SessionMetric, ...]:
    then, now = both
    return tuple(
        SessionMetric(name, unit_of(field), getattr(then, field, None), getattr(now, field, None))
        for name, field in fields
    )
