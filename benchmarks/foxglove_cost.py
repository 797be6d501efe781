"""Processor time of the bridge for a viewer at 20 times real time, by subscription.

`python -m benchmarks foxglove_cost`; `speed` is times real time, `seconds` how long for each row (wall clock), `tls`
whether viewers connect by TLS. The share is that of one core, reckoned for that speed from processor time over sim
time: on a busy machine the robot may fall behind.
"""

from __future__ import annotations

import json
import ssl
import threading
import time
from collections.abc import Collection, Iterator
from contextlib import ExitStack, contextmanager
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

from benchmarks._processes import cpu_s
from benchmarks._settings import NotHereError, Small
from benchmarks._system import RUNNING, Hand, SystemLost, running_system
from touchline.bus import Bus, Inbox
from touchline.bus.ports import free_port
from touchline.schemas import topics
from touchline.schemas.messages import Clock
from touchline.schemas.roles import Role
from touchline.security.authority import CertificateAuthority
from touchline.security.identity import Identity

_LAYOUT: Final = Path(__file__).resolve().parents[1] / "examples" / "viewers" / "layout.json"
_SETTLED: Final = 0.2
"""Share of the time of a row that passes before it."""
_ADVERTISED_S: Final = 2.0
_STANDS_S: Final = 60.0
SMALL: Final = Small(
    {"seconds": 1.0, "template": "tennis"},
    tuple(
        f"{name} #x # s in # s # % of a core at #x # messages/s"
        for name in ("nobody looks", "the layout, # topics", "everything, # topics")
    ),
)


class Looker:
    """Viewer that discards what it receives, in a thread.

    Attributes:
        messages: Number of received messages.
    """

    def __init__(self, socket: ClientConnection) -> None:
        self._socket = socket
        self.messages = 0

    def subscribe(self, wanted: Collection[str] | None) -> int:
        """Subscribe to topics by name, or to all; return their number."""
        channels: dict[str, int] = {}
        deadline = time.monotonic() + _ADVERTISED_S
        while time.monotonic() < deadline:
            try:
                received = self._socket.recv(timeout=0.2)
            except TimeoutError:
                continue
            if isinstance(received, str) and (message := json.loads(received))["op"] == "advertise":
                channels |= {each["topic"]: each["id"] for each in message["channels"]}
        numbers = [number for topic, number in channels.items() if wanted is None or topic in wanted]
        subscriptions = [{"id": number, "channelId": number} for number in numbers]
        self._socket.send(json.dumps({"op": "subscribe", "subscriptions": subscriptions}))
        threading.Thread(target=self._listen, daemon=True).start()
        return len(numbers)

    def _listen(self) -> None:
        try:
            for _ in self._socket:
                self.messages += 1
        except ConnectionClosed:
            return


@contextmanager
def looking(url: str, wanted: Collection[str] | None, context: ssl.SSLContext | None) -> Iterator[tuple[Looker, int]]:
    """Open a viewer with its subscriptions; yields it and the number of topics."""
    protocols = [Subprotocol("foxglove.sdk.v1")]
    with connect(url, ssl=context, subprotocols=protocols, max_size=None, close_timeout=0.1) as socket:
        looker = Looker(socket)
        yield looker, looker.subscribe(wanted)


def layout_topics() -> set[str]:
    """Topics of the shipped layout in Foxglove and Lichtblick, with all transforms."""
    text = _LAYOUT.read_text(encoding="utf-8")
    names = {f"/{topics.DEFAULT_NAMESPACE}/{topic.name}" for topic in (*topics.TOPICS, *topics.VIEWING)}
    transforms = {f"/{topics.DEFAULT_NAMESPACE}/{name}" for name in ("tf", "tf_static", "truth/tf")}
    return transforms | {name for name in names if f'"{name}"' in text or f'"{name}.' in text}


def identity_in(folder: Path) -> Identity:
    """Return the identity of a server of viewers on this machine, of a new authority."""
    authority = CertificateAuthority.create(folder / "keys")
    member = authority.new_member(Role.VIEWER, "main")
    authority.issue([member])
    return Identity.load(authority.folder_of(member))


def main(speed: float = 20.0, seconds: float = 15.0, template: str = "soccer-11", *, tls: bool = False) -> None:
    """Print a row for nobody, for a viewer with the layout, and for one with everything."""
    if find_spec("foxglove") is None:
        raise NotHereError("the package foxglove-sdk is not installed")
    address = f"127.0.0.1:{free_port()}"
    options, url, context = ["--foxglove", "--foxglove-listen", address], f"ws://{address}", None
    with ExitStack() as stack:
        if tls:
            identity = identity_in(Path(stack.enter_context(TemporaryDirectory())))
            options += ["--foxglove-cert", str(identity.certificate), "--foxglove-key", str(identity.key)]
            url, context = f"wss://{address}", ssl.create_default_context(cafile=identity.authority)
        system = stack.enter_context(running_system(speed, options=options))
        bus = stack.enter_context(Bus.open(topics.OPERATOR, system.config))
        hand = Hand(system, bus)
        hand.ready()
        hand.plan(template)
        pid = system.processes()[topics.BRIDGE]
        clock = bus.inbox([topics.CLOCK], keep="latest")

        def row(name: str, looker: Looker | None) -> None:
            while hand.state == RUNNING:  # from the beginning, so that the job does not end meanwhile
                hand.order(topics.ABORT)
                time.sleep(0.1)
                hand.listen()
            hand.drive(template)
            time.sleep(_SETTLED * seconds)
            begun_s, sim_s, taken_s = time.monotonic(), _later_s(clock, 0.0), cpu_s(pid)
            heard = looker.messages if looker is not None else 0
            time.sleep(seconds)
            passed_s, cost_s = _later_s(clock, sim_s) - sim_s, cpu_s(pid) - taken_s
            took_s = time.monotonic() - begun_s
            rate = (looker.messages - heard) / took_s if looker is not None else 0.0
            print(
                f"{name:28} {passed_s / took_s:5.1f}x  {cost_s:5.2f} s in {took_s:4.1f} s  "
                f"{speed * cost_s / passed_s:6.1%} of a core at {speed:g}x  {rate:7,.0f} messages/s"
            )

        row("nobody looks", None)
        with looking(url, layout_topics(), context) as (looker, count):
            row(f"the layout, {count} topics", looker)
        with looking(url, None, context) as (looker, count):
            row(f"everything, {count} topics", looker)


def _later_s(clock: Inbox, than_s: float) -> float:
    """Wait until the robot's clock is later than a time, and return it (s).

    Raises:
        SystemLost: The clock stands still.
    """
    deadline_s = time.monotonic() + _STANDS_S
    while time.monotonic() < deadline_s:
        for sample in clock.wait(1.0):
            message = sample.decode()
            if isinstance(message, Clock) and message.clock.seconds > than_s:
                return message.clock.seconds
    raise SystemLost(f"the robot's clock stands still at {than_s:.2f} s")
