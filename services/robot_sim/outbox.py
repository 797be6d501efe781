"""Outbox for the telemetry of a process's robots to a sender process, so that the control loop waits for no subscriber.

Messages are written to a pipe that never blocks; messages that the pipe does not take wait here, up to a limit, beyond
which they are dropped: the sequence numbers, which are given here, then show the gap to every subscriber. At the other
end is `sender`. If that process dies, or takes nothing for long, another takes its place.
"""

from __future__ import annotations

import fcntl
import os
import subprocess
import sys
import time
import uuid
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Final

from touchline.bus import Bus, BusConfig
from touchline.schemas import topics
from touchline.schemas.traversal_state import traversal_state
from touchline.services.robot_sim.frame import CARRIED, HEADER, NUMBERS, publisher_id
from touchline.services.robot_sim.packing import Payload
from touchline.supervision.safe_path import safe_path

_PIPE_BYTES: Final = 1024 * 1024
MOST_BYTES: Final = 64 * 1024 * 1024
"""Limit of the waiting messages: half a minute of telemetry at 20 times real time."""
BEHIND_BYTES: Final = 2 * 1024 * 1024
"""Amount of waiting messages above which sim time that passes as fast as possible is held."""
STUCK_S: Final = 10.0
"""Time after which a sender that takes nothing, though something waits, is replaced. One subscriber that takes nothing
holds it up for `PATIENCE_S` of the bus at most."""
_CLOSING_S: Final = 3.0


class Outbox:
    """Sender's end in the control loop; use `send` for all, `turn` often, and `close` at the end.

    Args:
        config: Configuration of the bus, with the robots of this process.
        clock: Monotonic seconds.

    Attributes:
        run: Id that distinguishes the publishers of this run of the robots.
        waiting_bytes: Size of the messages that the pipe has not taken yet.
        dropped: Number of messages for which there was no room.
        restarts: Number of times that the sender was replaced.
    """

    def __init__(self, config: BusConfig, clock: Callable[[], float] = time.monotonic) -> None:
        self._config, self._clock = config, clock
        self.run = uuid.uuid4().hex
        self._sequences = [0] * (len(config.namespaces) * len(CARRIED))
        self._latest: dict[int, bytes] = {}
        self._waiting: deque[memoryview] = deque()
        self._cut = False
        self.waiting_bytes = 0
        self.dropped = 0
        self.restarts = 0
        self._start()

    def _start(self) -> None:
        reader, self._pipe = os.pipe()
        if hasattr(fcntl, "F_SETPIPE_SZ"):
            with suppress(OSError):  # a user may have only so much; then more waits here
                fcntl.fcntl(self._pipe, fcntl.F_SETPIPE_SZ, _PIPE_BYTES)
        os.set_blocking(self._pipe, False)
        self._sender = subprocess.Popen(
            [sys.executable, "-P", "-m", "touchline.services.robot_sim.sender", str(reader), self.run],
            stdin=subprocess.DEVNULL,
            pass_fds=[reader],
            env={**os.environ, **self._config.environment(), **safe_path()},
        )
        os.close(reader)
        self._taken_at_s = self._clock()

    @property
    def pid(self) -> int:
        """Id of the process that publishes."""
        return self._sender.pid

    @property
    def behind(self) -> bool:
        """True if so much waits that sim time should not run ahead."""
        return self.waiting_bytes > BEHIND_BYTES

    def send(self, payloads: Sequence[Payload], robot: int = 0) -> int:
        """Send messages to be published, in this order; never waits.

        Args:
            payloads: Messages of one robot.
            robot: Index of the robot in this process, from 0.

        Returns:
            Number of messages for which there was no room.
        """
        frames: list[bytes] = []
        first = robot * len(CARRIED)
        for topic, payload in payloads:
            number = first + NUMBERS[topic.name]
            self._sequences[number] += 1
            header = HEADER.pack(len(payload), number, self._sequences[number])
            frames += (header, payload)
            if topic.latched:
                self._latest[number] = header + payload
        dropped = 0 if self._put(b"".join(frames)) else len(payloads)
        self.dropped += dropped
        self._flush()
        return dropped

    def sequence(self, topic: str, robot: int) -> int:
        """Return the number of the last message of a robot's topic, by its name."""
        return self._sequences[robot * len(CARRIED) + NUMBERS[topic]]

    def _put(self, batch: bytes) -> bool:
        """Queue a batch; return False if there is no room."""
        if self.waiting_bytes + len(batch) > MOST_BYTES:
            return False
        if batch:
            self._waiting.append(memoryview(batch))
            self.waiting_bytes += len(batch)
        return True

    def _flush(self) -> None:
        while self._waiting:
            batch = self._waiting[0]
            try:
                written = os.write(self._pipe, batch)
            except BlockingIOError:
                return
            except BrokenPipeError:  # `turn` replaces the sender
                return
            self.waiting_bytes -= written
            self._taken_at_s = self._clock()
            if written < len(batch):
                self._waiting[0] = batch[written:]
                self._cut = True
                return
            self._waiting.popleft()
            self._cut = False

    def turn(self) -> bool:
        """Pass on waiting messages, and replace a sender that died or is stuck; return True if it was replaced.

        Messages that the old sender had not published are lost except for the latched ones; paint has to be published
        anew.
        """
        self._flush()
        if not self._waiting:
            self._taken_at_s = self._clock()
        if self._sender.poll() is None and self._clock() - self._taken_at_s < STUCK_S:
            return False
        self._sender.kill()
        self._sender.wait()
        os.close(self._pipe)
        if self._cut:  # the rest of a batch makes no sense without its beginning
            self.waiting_bytes -= len(self._waiting.popleft())
            self._cut = False
        self.restarts += 1
        self._start()
        latest = memoryview(b"".join(self._latest.values()))
        self._waiting.appendleft(latest)
        self.waiting_bytes += len(latest)
        return True

    def close(self) -> None:
        """Publish everything, as far as that takes no longer than a few seconds, and end the sender."""
        deadline = self._clock() + _CLOSING_S
        while self._waiting and self._clock() < deadline and self._sender.poll() is None:
            self._flush()
            time.sleep(0.002)
        os.close(self._pipe)
        try:
            self._sender.wait(_CLOSING_S)
        except subprocess.TimeoutExpired:
            self._sender.kill()
            self._sender.wait()


class RobotOutlet:
    """One robot's end of an `Outbox`, which also publishes changes of the robot's state by its own session.

    Telemetry waits for as long as a subscriber takes none; the news that the robot stands must not.

    Attributes:
        dropped: Number of messages of this robot for which there was no room.
    """

    def __init__(self, outbox: Outbox, bus: Bus, robot: int = 0) -> None:
        """Make the outlet of a robot.

        Args:
            outbox: Outbox of the process.
            bus: Bus of the robot.
            robot: Index of the robot in it, from 0.
        """
        self._outbox, self._robot = outbox, robot
        self._known_restarts = outbox.restarts
        self.dropped = 0
        self._prompt = {
            topic.name: bus.prompt_publisher(topic, publisher_id(outbox.run, bus.key(topic.name)))
            for topic in CARRIED
            if topic.prompt
        }
        self._state = -1

    @property
    def behind(self) -> bool:
        """True if so much waits, of all robots together, that sim time should not run ahead."""
        return self._outbox.behind

    @property
    def restarts(self) -> int:
        """Number of times that the process that publishes was replaced."""
        return self._outbox.restarts

    def send(self, payloads: Sequence[Payload]) -> None:
        """Send messages to be published, in this order; never waits."""
        self.dropped += self._outbox.send(payloads, self._robot)
        last = {topic.name: payload for topic, payload in payloads if topic.prompt}
        for name, payload in last.items():
            if self._is_news(name, payload):
                self._prompt[name].send(payload, self._outbox.sequence(name, self._robot))

    def _is_news(self, topic: str, payload: bytes) -> bool:
        if topic != topics.STATUS.name:
            return True
        before, self._state = self._state, traversal_state(payload)
        return before != self._state

    def turn(self) -> bool:
        """Turn the outbox; return True if this robot's paint has to be published anew."""
        self._outbox.turn()
        known, self._known_restarts = self._known_restarts, self._outbox.restarts
        return known != self._known_restarts
