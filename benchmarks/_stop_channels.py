"""Channels of emergency stops by a person, who repeats each until it is acknowledged."""

from __future__ import annotations

import fcntl
import os
import pty
import random
import re
import struct
import subprocess
import sys
import termios
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from typing import Final, NamedTuple

import zenoh
from zenoh import handlers

from benchmarks._stranger_roles import peer
from benchmarks._system import COMMAND, ROS_DOMAIN, System, new_id
from touchline.bus import Bus
from touchline.schemas import topics
from touchline.schemas.cdr import decode, encode, service_type_hash
from touchline.schemas.errors import PayloadError, TouchlineError
from touchline.schemas.messages import CommandRequest, CommandResponse

_ATTEMPT_S: Final = 0.7
_ORDER_S: Final = 15.0
_POLL_S: Final = 0.001


class StopAnswer(NamedTuple):
    """Answer to a stop.

    Attributes:
        at_s: Time of the answer (monotonic).
        done: Whether it reports success.
        text: Text of the answer.
    """

    at_s: float
    done: bool
    text: str


class StopChannel(ABC):
    """Channel of emergency stops.

    Attributes:
        answers: Answers, in order.
        sent_s: Time at which the stop was given (monotonic).
    """

    def __init__(self) -> None:
        """Create the channel, without a stop."""
        self.answers: list[StopAnswer] = []
        self.sent_s = 0.0

    def send(self, chance: random.Random) -> None:
        """Give the stop, without waiting."""
        self.answers = []
        self._send(chance)

    @abstractmethod
    def _send(self, chance: random.Random) -> None: ...

    @abstractmethod
    def poll(self) -> None:
        """Process answers, and repeat a stop without one; to be called often until the stop is acknowledged."""

    @abstractmethod
    def rest(self) -> None:
        """End the trial: nothing more is sent."""

    @property
    def acknowledged(self) -> StopAnswer | None:
        """First answer that reports success."""
        return next((saying for saying in self.answers if saying.done), None)

    def _tell(self, done: bool, text: str) -> None:
        self.answers.append(StopAnswer(time.monotonic(), done, text))


class ByCall(StopChannel):
    """Channel of calls by a process that is on the bus already."""

    def __init__(self, bus: Bus) -> None:
        """Create the channel over `bus`."""
        super().__init__()
        self._bus = bus
        self._resting = threading.Event()
        self._thread: threading.Thread | None = None

    def _send(self, chance: random.Random) -> None:
        self._resting = threading.Event()
        self._thread = threading.Thread(target=self._repeat, args=(new_id(), self._resting))
        self.sent_s = time.monotonic()
        self._thread.start()

    def _repeat(self, request_id: str, resting: threading.Event) -> None:
        while not resting.is_set():
            try:
                answer = self._bus.call(topics.ESTOP, CommandRequest(request_id=request_id), _ATTEMPT_S)
            except TouchlineError as error:
                self._tell(False, str(error))
                continue
            self._tell(answer.success, answer.message)
            if answer.success:
                return

    def poll(self) -> None:
        """Do nothing, as a thread processes answers."""
        time.sleep(_POLL_S)

    def rest(self) -> None:
        """Stop repeating the call."""
        self._resting.set()
        if self._thread is not None:
            self._thread.join()


class ByOrder(StopChannel):
    """`touchline order estop`: a process that joins the bus for it, and repeats the stop until it is acknowledged.

    It is given when the command begins with it; Python's own start is not counted.
    """

    _STARTED = """
import sys, time
import touchline.bus as bus, touchline.cli as cli, touchline.cli.commands, touchline.cli.order_command

repeat = bus.repeat_until_acknowledged

def noted(*arguments, **options):
    sys.stderr.write(f"{time.monotonic()}\\n")
    sys.stderr.flush()
    return repeat(*arguments, **options)

bus.repeat_until_acknowledged = noted
sys.stdin.readline()
sys.argv = ["touchline", "order", "estop"]
cli.main()
"""
    """The command, which writes the time at which it begins to ask."""

    def __init__(self, system: System) -> None:
        """Start a command that is ready to be triggered."""
        super().__init__()
        self._environment = {**os.environ, **system.environment}
        self._waiting = self._prepared()
        self._running: subprocess.Popen[str] | None = None
        self._reader: threading.Thread | None = None
        self._begun_s = 0.0

    def _prepared(self) -> subprocess.Popen[str]:
        return subprocess.Popen(
            [sys.executable, "-c", self._STARTED],
            env=self._environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )

    def _send(self, chance: random.Random) -> None:
        self.sent_s = time.monotonic()
        self._run(first=True)

    def _run(self, *, first: bool) -> None:
        assert self._waiting.stdin is not None
        self._waiting.stdin.write("\n")
        self._waiting.stdin.flush()
        self._running, self._waiting = self._waiting, self._prepared()
        self._begun_s = time.monotonic()
        self._reader = threading.Thread(target=self._listen, args=(self._running, first))
        self._reader.start()

    def _listen(self, running: subprocess.Popen[str], first: bool) -> None:
        """Process the command's output as it comes."""
        assert running.stdout is not None
        begun = running.stdout.readline()
        if first:
            with suppress(ValueError):
                self.sent_s = float(begun)
        for line in running.stdout:
            self._tell(line.startswith("estop: ") and "NOT ACKNOWLEDGED" not in line, line.strip())

    def poll(self) -> None:
        """Run the command again if it has ended without success."""
        time.sleep(_POLL_S)
        if self._running is None:
            return
        if self._running.poll() is None:
            if time.monotonic() - self._begun_s < _ORDER_S:
                return
            self._running.kill()
        self._end()
        if self.acknowledged is None:
            self._run(first=False)

    def _end(self) -> None:
        """Process the remaining output of the ended command."""
        assert self._running is not None
        assert self._reader is not None
        self._running.wait()
        self._reader.join()
        self._close_pipes(self._running)
        self._running = None

    def rest(self) -> None:
        """End the running command."""
        if self._running is not None:
            self._running.kill()
            self._end()

    def close(self) -> None:
        """End all commands."""
        self.rest()
        self._waiting.kill()
        self._waiting.wait()
        self._close_pipes(self._waiting)

    @staticmethod
    def _close_pipes(process: subprocess.Popen[str]) -> None:
        for pipe in (process.stdin, process.stdout):
            if pipe is not None:
                pipe.close()


class ByRos2(StopChannel):
    """Channel of a ROS 2 client in rmw_zenoh's format, through the gateway."""

    def __init__(self, session: zenoh.Session) -> None:
        """Create the channel over a session among ROS 2 nodes."""
        super().__init__()
        self._session = session
        name = f"{topics.DEFAULT_NAMESPACE}/{topics.ESTOP.name}"
        digest = service_type_hash(topics.ESTOP.ros_type)
        self._key = f"{ROS_DOMAIN}/{name}/touchline_msgs::srv::dds_::Command_/{digest}"
        self._client = os.urandom(16)
        self._number = 0
        self._replies: zenoh.handlers.Handler[zenoh.Reply] | None = None
        self._request = b""

    def _send(self, chance: random.Random) -> None:
        self._request = encode(CommandRequest(request_id=new_id()))
        self.sent_s = time.monotonic()
        self._ask()

    def _ask(self) -> None:
        self._number += 1
        attachment = struct.pack("<qqB16s", self._number, time.time_ns(), 16, self._client)
        self._replies = self._session.get(
            self._key, handlers.FifoChannel(4), payload=self._request, attachment=attachment, timeout=_ATTEMPT_S
        )

    def poll(self) -> None:
        """Process the answer; ask again if there was none."""
        time.sleep(_POLL_S)
        if self._replies is None:
            return
        try:
            reply = self._replies.try_recv()
        except zenoh.ZError:  # nobody has answered
            self._tell(False, "no answer through the gateway")
            self._ask()
            return
        if reply is None:
            return
        self._replies = None
        if reply.ok is not None:
            with suppress(PayloadError):
                answer = decode(CommandResponse, reply.ok.payload.to_bytes())
                self._tell(answer.success, answer.message)
        else:
            self._tell(False, "an error through the gateway")
        if self.acknowledged is None:
            self._ask()

    def rest(self) -> None:
        """Stop asking."""
        self._replies = None


class ByConsole(StopChannel):
    """Channel of keys of `touchline tui` on a terminal, whose screen holds the answers."""

    _ESCAPES = re.compile(rb"\x1b(\[[0-9;?<>=]*[a-zA-Z]|\][^\a\x1b]*(\a|\x1b\\)|[=>()][0-9A-Za-z]?)")
    _UNACKNOWLEDGED = re.compile(r"NOT\s*ACKNOWLEDGED|E-STOP\s*SENT", re.IGNORECASE)
    _ESCAPED_S = 0.2
    """Time after which a terminal takes an escape for the key of that name."""
    _MASHED = (
        "\x1b[A",
        "\x1b[B",
        "\x1b[C",
        "\x1b[D",
        "r",
        "r",
        "r",
        " ",
        "f",
        "0",
        "+",
        "-",
        "?",
        "s",
        "l",
        ".",
        ",",
    )

    def __init__(self, system: System) -> None:
        """Open the console."""
        super().__init__()
        self._main, other = pty.openpty()
        fcntl.ioctl(other, termios.TIOCSWINSZ, struct.pack("HHHH", 40, 140, 0, 0))
        self._process = subprocess.Popen(
            [*COMMAND, "tui"],
            env={**os.environ, **system.environment, "TERM": "xterm-256color"},
            stdin=other,
            stdout=other,
            stderr=other,
            start_new_session=True,
        )
        os.close(other)
        os.set_blocking(self._main, False)
        self._lock = threading.Lock()
        self._shown = bytearray()
        self._open = False
        self._ended = threading.Event()
        self._reader = threading.Thread(target=self._read)
        self._reader.start()

    @property
    def alive(self) -> bool:
        """True if the console still runs."""
        return self._process.poll() is None

    def wait_until_open(self, timeout_s: float = 30.0) -> bool:
        """Wait until the console has drawn its screen; false if it has ended."""
        deadline = time.monotonic() + timeout_s
        while not self._open and self.alive and time.monotonic() < deadline:
            self._open = "IDLE" in self.screen().upper() or "RUNNING" in self.screen().upper()
            time.sleep(0.02)
        return self._open and self.alive

    def screen(self) -> str:
        """Output of the console since the stop, without the terminal's sequences."""
        with self._lock:
            shown = bytes(self._shown)
        return self._ESCAPES.sub(b"", shown).decode(errors="replace")

    def _read(self) -> None:
        while not self._ended.is_set():
            try:
                said = os.read(self._main, 65536)
            except BlockingIOError:
                time.sleep(0.005)
                continue
            except OSError:
                return
            with self._lock:
                self._shown += said

    def _press(self, keys: str) -> None:
        with suppress(OSError):
            os.write(self._main, keys.encode())

    def mash(self, chance: random.Random) -> None:
        """Press any keys but those that stop, abort or leave."""
        for _ in range(chance.randrange(1, 60)):
            self._press(chance.choice(self._MASHED))

    def _send(self, chance: random.Random) -> None:
        with self._lock:
            self._shown.clear()
        self.sent_s = time.monotonic()
        self._press("\x05")  # Ctrl-E works everywhere in the console, also in a field of text

    def poll(self) -> None:
        """Read answers from the screen."""
        time.sleep(_POLL_S)
        if self.answers:
            return
        if self._UNACKNOWLEDGED.search(self.screen()):
            self._tell(False, "shown as not acknowledged")

    def rest(self) -> None:
        """Close any dialog that the keys have opened."""
        for _ in range(2):
            self._press("\x1b")
            time.sleep(self._ESCAPED_S)

    def close(self) -> None:
        """End the console."""
        self._ended.set()
        self._process.kill()
        self._process.wait()
        self._reader.join()
        os.close(self._main)


@contextmanager
def stop_channels(system: System, bus: Bus, names: frozenset[str]) -> Iterator[dict[str, StopChannel]]:
    """Open the channels of these names into a running system."""
    with ExitStack() as stack:
        makers: Mapping[str, Callable[[], StopChannel]] = {
            "call": lambda: ByCall(bus),
            "order": lambda: _closing(stack, ByOrder(system)),
            "console": lambda: _closing(stack, ByConsole(system)),
            "ros2": lambda: ByRos2(stack.enter_context(peer(f"tcp/127.0.0.1:{system.ros2_port}"))),
        }
        yield {name: make() for name, make in makers.items() if name in names}


CHANNELS: Final = ("call", "order", "console", "ros2")


def _closing(stack: ExitStack, channel: ByOrder | ByConsole) -> StopChannel:
    stack.callback(channel.close)
    return channel
