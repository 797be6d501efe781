"""Health reports of a process: diagnostics five times per second, and on request."""

import os
import time
from collections.abc import Callable, Mapping
from datetime import UTC, datetime

from touchline.bus import last_sent
from touchline.bus.bus import Bus
from touchline.bus.calls import ServedCall
from touchline.schemas import topics
from touchline.schemas.messages import (
    Clock,
    DiagnosticArray,
    DiagnosticStatus,
    GetDiagnosticsRequest,
    GetDiagnosticsResponse,
    Header,
    KeyValue,
    Time,
)

_PERIOD_S = 1.0 / topics.DIAGNOSTICS.rate_hz
_ANSWERS_AT_ONCE = 8
#: Beginning of the message of a process that is not ready yet.
STARTING = "starting: "


class HealthReporter:
    """Publishes a process's diagnostics and answers requests for them.

    An answer includes what was sent of each topic (`touchline.bus.last_sent`). The stamp is the bus's time, the last
    clock that was heard (0 before the first); wall time is one of the values.

    Attributes:
        common: Values of the whole process, added to those of each `poll`.
    """

    def __init__(self, bus: Bus) -> None:
        """Start to serve ``<node>/diagnostics``."""
        self._bus = bus
        self.common: Callable[[], Mapping[str, object]] = dict
        self._publisher = bus.publisher(topics.DIAGNOSTICS)
        self._server = bus.serve(topics.diagnostics_service(bus.node))
        self._clock = bus.inbox([topics.CLOCK], keep="latest")
        self._now = Time()
        self._due = 0.0
        self._asked: ServedCall[GetDiagnosticsRequest, GetDiagnosticsResponse] | None = None

    @property
    def due(self) -> bool:
        """True if a request waits, or it is time to publish: else `poll` has nothing to do."""
        if self._asked is None:
            self._asked = self._server.poll()
        return self._asked is not None or time.monotonic() >= self._due

    def poll(
        self,
        values: Mapping[str, object],
        *,
        level: int = DiagnosticStatus.OK,
        message: str = "ok",
        settle: Callable[[], None] = lambda: None,
        at_once: bool = False,
    ) -> None:
        """Answer waiting requests, and publish five times per second of wall time; to be called often.

        Args:
            values: Values of the diagnostics.
            level: Level of the status, as in `DiagnosticStatus`.
            message: Message of the status.
            settle: Called between a request and its answer, to send what has to come before that.
            at_once: Publish now.
        """
        for _ in range(_ANSWERS_AT_ONCE):
            call, self._asked = self._asked or self._server.poll(), None
            if call is None:
                break
            settle()
            asked = {**values, last_sent.KEY: last_sent.as_text(self._bus.sent())}
            call.reply(GetDiagnosticsResponse(diagnostics=self._report(asked, level, message)))
        if at_once or time.monotonic() >= self._due:
            self._due = time.monotonic() + _PERIOD_S
            self._publisher.send(self._report(values, level, message))

    def starting(self, doing: str) -> None:
        """Publish what the process does before it can serve; it counts as ready from the first :meth:`poll`."""
        self._publisher.send(self._report({}, DiagnosticStatus.WARN, f"{STARTING}{doing}"))

    def _report(self, values: Mapping[str, object], level: int, message: str) -> DiagnosticArray:
        for _, heard in self._clock.messages():
            if isinstance(heard, Clock):
                self._now = heard.clock
        counters = self._bus.counters
        everything: dict[str, object] = {
            "pid": os.getpid(),
            "wall_time": datetime.now(UTC).isoformat(timespec="milliseconds"),
            "published": counters.published,
            "received": counters.received,
            "lost": counters.lost,
            "rejected": counters.rejected,
            "last_rejection": counters.last_rejection,
            **self.common(),
            **values,
        }
        status = DiagnosticStatus(
            level=level,
            name=self._bus.node,
            message=message,
            values=tuple(KeyValue(key=key, value=str(value)) for key, value in everything.items()),
        )
        return DiagnosticArray(header=Header(stamp=self._now), status=(status,))
