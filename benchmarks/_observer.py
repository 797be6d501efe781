"""Independent listener to the robot's messages."""

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
    """Listener to status, wheel commands and diagnostics, with the wall time of their arrival.

    Attributes:
        state: Last state of the robot.
        reason: Reason in the last status.
        estopped_s: Time since which it reports an emergency stop (monotonic); `None` while it does not. Status and
            diagnostics come by separate routes: what is older by sim time is ignored.
        braked_s: Time since which no wheel is commanded to turn.
        robot: Id of the status's publisher, one per process.
        robot_since_s: Time of its first message.
        serving_s: Time at which each process of the robot, by its id, first reported a state in its diagnostics.
        heard_s: Time of the last diagnostics of each node.
    """

    def __init__(self, bus: Bus) -> None:
        """Subscribe to the topics."""
        self._inbox = bus.inbox([topics.STATUS, topics.ACTUATOR_COMMAND, topics.DIAGNOSTICS], keep="recent")
        self.state = -1
        self.reason = ""
        self.estopped_s: float | None = None
        self.braked_s: float | None = None
        self.robot = b""
        self.robot_since_s = 0.0
        self.serving_s: dict[str, float] = {}
        self._reported_at = -math.inf
        self.heard_s: dict[str, float] = {}

    def poll(self) -> None:
        """Process pending messages."""
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
                self.braked_s = self.braked_s or now_s  # commands of the previous process ended with it
                self._reported_at = -math.inf
            stamp = message.header.stamp
            if message.state != ESTOPPED and stamp.sec + 1e-9 * stamp.nanosec <= self._reported_at:
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
        """Process the robot's state in its diagnostics, which come by a separate route."""
        for status in message.status:
            values = {pair.key: pair.value for pair in status.values}
            if status.name != topics.ROBOT_SIM or "state" not in values:
                continue
            self.serving_s.setdefault(values.get("pid", ""), now_s)
            if values["state"] == str(ESTOPPED) and self.estopped_s is None:
                self.estopped_s, self._reported_at = now_s, float(values["sim_time_s"])

    def watch(self, duration_s: float) -> None:
        """Listen for a while."""
        deadline = time.monotonic() + duration_s
        while time.monotonic() < deadline:
            self.poll()
            time.sleep(0.002)
