"""Sender: the process that publishes the telemetry of the robots of another process and answers requests for paint.

It reads `frame`s from a pipe and publishes them on the bus. A subscriber that does not take them holds up this process,
but not the robot, and not for long: after the bus's patience it is cut off, reported, and counted.
"""

from __future__ import annotations

import os
import select
import signal
import sys
import time
from collections.abc import Callable, Sequence
from typing import Final

from touchline.bus import Bus, BusConfig, HealthReporter
from touchline.bus.calls import ServedCall
from touchline.bus.common_settings import PATIENCE_S
from touchline.schemas import topics
from touchline.schemas.messages import Event, GetPaintRequest, GetPaintResponse, Header, Time
from touchline.schemas.paint_history import PaintHistory
from touchline.services.robot_sim.frame import CARRIED, HEADER, publisher_id
from touchline.supervision.priority import USUAL, run_at

_READ_BYTES: Final = 1024 * 1024
_DRAIN_BYTES: Final = 16 * 1024 * 1024
"""Largest amount that is read before requests are checked again."""
_IDLE_S: Final = 0.01
_ANSWER_EVERY_S: Final = 0.1
"""Shortest interval between answers with the paint: they may be megabytes."""
_CUT_OFF_S: Final = 0.9 * PATIENCE_S

_PaintCall = ServedCall[GetPaintRequest, GetPaintResponse]


class Sender:
    """Publisher of the messages from the pipe; call `turn` in a loop.

    Args:
        buses: Buses of the node `telemetry`, one for each robot.
        run: Id that distinguishes the publishers of this run of the robots; a sender that replaces another has the
            same.
    """

    def __init__(self, buses: Sequence[Bus], run: str) -> None:
        self._robots = [_RobotPublisher(bus, run) for bus in buses]
        self._rest = b""

    def turn(self, pipe: int) -> bool:
        """Publish all available messages and answer requests; return False once the pipe is closed and empty."""
        # Messages that had been sent before a request came are published before its answer.
        asked = [(robot, call) for robot in self._robots if (call := robot.asked()) is not None]
        is_open = True

        def drain() -> None:
            nonlocal is_open
            is_open = self._drain(pipe)

        drain()
        for robot in self._robots:
            robot.publish_health(drain)
        for robot, call in asked:
            robot.answer(call)
        return is_open

    def _drain(self, pipe: int) -> bool:
        """Publish all messages in the pipe; return False at its end."""
        for _ in range(_DRAIN_BYTES // _READ_BYTES):
            try:
                data = os.read(pipe, _READ_BYTES)
            except BlockingIOError:
                for robot in self._robots:
                    robot.paint.link()
                return True
            if not data:
                return False
            self.publish(data)
        return True

    def publish(self, data: bytes) -> None:
        """Publish the frames in `data`, of which the last need not be complete."""
        data = self._rest + data
        at, end = 0, len(data)
        while at + HEADER.size <= end:
            size, number, sequence = HEADER.unpack_from(data, at)
            begin = at + HEADER.size
            if begin + size > end:
                break
            at = begin + size
            self._put(number, data[begin:at], sequence)
        self._rest = data[at:]

    def _put(self, number: int, payload: bytes, sequence: int) -> None:
        robot, topic = divmod(number, len(CARRIED))
        self._robots[robot].put(topic, payload, sequence)


class _RobotPublisher:
    """Messages of one robot, and its paint."""

    def __init__(self, bus: Bus, run: str) -> None:
        self._bus = bus
        self._publishers = [bus.publisher(topic, publisher_id(run, bus.key(topic.name))) for topic in CARRIED]
        self._health = HealthReporter(bus)
        self._events = bus.publisher(topics.SUPERVISOR_EVENTS)
        self._get_paint = bus.serve(topics.GET_PAINT)
        self.paint = PaintHistory()
        self._answer_at_s = 0.0
        self._cut_off = 0

    def asked(self) -> _PaintCall | None:
        """Return a request for all paint, if one waits and the next answer is due."""
        return self._get_paint.poll() if time.monotonic() >= self._answer_at_s else None

    def answer(self, asked: _PaintCall) -> None:
        """Answer with all paint."""
        asked.reply_bytes(self.paint.answer())
        self._answer_at_s = time.monotonic() + _ANSWER_EVERY_S

    def publish_health(self, settle: Callable[[], None]) -> None:
        """Publish the diagnostics of this process; `settle` is called between a question and its answer."""
        if not self._health.due:
            return
        figures = {"forwarded": self._bus.counters.published, "cut_off": self._cut_off}
        self._health.poll(figures, message="sending", settle=settle)

    def put(self, number: int, payload: bytes, sequence: int) -> None:
        """Publish one message of a topic."""
        topic = CARRIED[number]
        if topic is topics.PLAN:
            self.paint.clear()
        elif topic is topics.PAINT:
            self.paint.add(payload)
        begun_s = time.monotonic()
        self._publishers[number].send_numbered(payload, sequence)
        if time.monotonic() - begun_s > _CUT_OFF_S:
            self._report_cut_off()

    def _report_cut_off(self) -> None:
        self._cut_off += 1
        text = f"a subscriber that took no telemetry for {PATIENCE_S:g} s was cut off; it may join again"
        stamp = Header(stamp=Time.of_ns(time.time_ns()))
        self._events.send(
            Event(header=stamp, severity=Event.WARN, source=topics.TELEMETRY, code="subscriber-cut-off", text=text)
        )


def main(pipe: int, run: str) -> None:
    """Publish the messages in a pipe until it is closed.

    Args:
        pipe: File descriptor of the pipe.
        run: Id of the run, as in `Sender`.
    """
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)  # the robot's process ends this one, when everything has been published
    run_at(USUAL)  # it inherits the robot's, whose loop comes first
    os.set_blocking(pipe, False)
    wait = select.poll()
    wait.register(pipe, select.POLLIN)
    with Bus.open_all(topics.TELEMETRY, BusConfig.from_environment(), lambda: False) as buses:
        sender = Sender(buses, run)
        while sender.turn(pipe):
            wait.poll(1e3 * _IDLE_S)


if __name__ == "__main__":
    main(int(sys.argv[1]), sys.argv[2])
