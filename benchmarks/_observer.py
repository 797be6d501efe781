"""An independent listener: what the robot does, as heard by somebody who takes no part."""

from __future__ import annotations

import math
import time
from typing import Final

from touchline.bus import Bus, Sample
from touchline.schemas import topics
from touchline.schemas.errors import PayloadError
from touchline.schemas.messages import ActuatorCommand, DiagnosticArray, TraversalStatus

ESTOPPED: Final = TraversalStatus.ESTOPPED


class Observer:
    """Hears status, wheel commands and diagnostics, with the wall time at which they came.

    Attributes:
        state: The robot's, as last heard.
        reason: The status's.
        estopped_s: Since when it says that it is stopped (monotonic); `None` while it is not. Its status and its
            diagnostics come by ways of their own: what is older by sim time is no news.
        braked_s: Since when no wheel is commanded to turn.
        robot: Id of the status's publisher: another one is another process.
        robot_since_s: When that was first heard.
        serving_s: When each process of the robot, by its id, first told a state in its diagnostics.
        heard_s: When each node last told how it is.
    """

    def __init__(self, bus: Bus) -> None:
        """Listen."""
        self._inbox = bus.inbox([topics.STATUS, topics.ACTUATOR_COMMAND, topics.DIAGNOSTICS], keep="recent")
        self.state = -1
        self.reason = ""
        self.estopped_s: float | None = None
        self.braked_s: float | None = None
        self.robot = b""
        self.robot_since_s = 0.0
        self.serving_s: dict[str, float] = {}
        self._told_at = -math.inf
        self.heard_s: dict[str, float] = {}

    def poll(self) -> None:
        """Take in what came."""
        samples = self._inbox.drain()
        now_s = time.monotonic()
        for sample in samples:
            try:
                self._take(sample, now_s)
            except PayloadError:
                continue  # of a stranger

    def _take(self, sample: Sample, now_s: float) -> None:
        message = sample.decode()
        if isinstance(message, ActuatorCommand):
            if message.values.any():
                self.braked_s = None
            elif self.braked_s is None:
                self.braked_s = now_s
        elif isinstance(message, TraversalStatus):
            if sample.publisher != self.robot:
                self.robot, self.robot_since_s = sample.publisher, now_s
                self.braked_s = self.braked_s or now_s  # what the process before it commanded ended with it
                self._told_at = -math.inf
            stamp = message.header.stamp
            if message.state != ESTOPPED and stamp.sec + 1e-9 * stamp.nanosec <= self._told_at:
                return
            self.state, self.reason = message.state, message.reason
            if message.state != ESTOPPED:
                self.estopped_s = None
            elif self.estopped_s is None:
                self.estopped_s = now_s
        elif isinstance(message, DiagnosticArray):
            self.heard_s |= {status.name: now_s for status in message.status}
            self._take_state(message, now_s)

    def _take_state(self, message: DiagnosticArray, now_s: float) -> None:
        """The robot's diagnostics tell its state, too, by a way of their own."""
        for status in message.status:
            told = {pair.key: pair.value for pair in status.values}
            if status.name != topics.ROBOT_SIM or "state" not in told:
                continue
            self.serving_s.setdefault(told.get("pid", ""), now_s)
            if told["state"] == str(ESTOPPED) and self.estopped_s is None:
                self.estopped_s, self._told_at = now_s, float(told["sim_time_s"])

    def watch(self, duration_s: float) -> None:
        """Listen for a while."""
        deadline = time.monotonic() + duration_s
        while time.monotonic() < deadline:
            self.poll()
            time.sleep(0.002)
