"""Roles of strangers, one per process: `python -m benchmarks._stranger_roles ROLE`; prints `begun` when ready.

Everything here is spelled for the wire: a stranger does not use the bus's own classes. Only payloads are made with
Touchline's encoder, so that they get as far as possible.
"""

from __future__ import annotations

import json
import os
import random
import resource
import socket
import struct
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Final

import zenoh
from zenoh import handlers

from touchline.bus.caller import asked_key
from touchline.bus.common_settings import PATIENCE_S
from touchline.bus.config import DEFAULT_ENDPOINT
from touchline.bus.secured_settings import secured_client
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.bus_variables import ENDPOINT_VARIABLE, IDENTITY_VARIABLE, NAMESPACE_VARIABLE
from touchline.schemas.cdr import encode
from touchline.schemas.curves import Curve
from touchline.schemas.messages import Actuation, Trajectory
from touchline.schemas.trajectories import assemble, segment, velocity
from touchline.security.identity import Identity

SPEED_VARIABLE: Final = "TOUCHLINE_STRANGER_SPEED"
"""Speed that a flood of `simulation/set_speed` asks for."""
KEEP_VARIABLE: Final = "TOUCHLINE_STRANGER_FILES"
"""Folder of payloads that take long to make."""
IMPOSTOR: Final = "FAKE"
"""Beginning of every answer in another's name."""
_ENDPOINT: Final = os.environ.get(ENDPOINT_VARIABLE, DEFAULT_ENDPOINT)
_NAMESPACE: Final = os.environ.get(NAMESPACE_VARIABLE, topics.DEFAULT_NAMESPACE)
_PLACEHOLDER: Final = b"0123456789abcdef0123456789abcdef"
_ATTACHMENT: Final = struct.Struct("<qqB16s")
_CONNECTIONS: Final = 600
_PEERS: Final = 25
_LARGE_BYTES: Final = 9_700_000
_REPEATED_KEYS_BYTES: Final = 1_100_000


def main() -> None:
    """Misbehave until killed, or until who started this is gone."""
    threading.Thread(target=_end_with, args=(os.getppid(),), daemon=True).start()
    ROLES[sys.argv[1]]()


def _end_with(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(1.0)
    os._exit(1)


def _begun() -> None:
    sys.stdout.write("begun\n")
    sys.stdout.flush()


def peer(endpoint: str) -> zenoh.Session:
    """A peer that meets all others at an endpoint and listens nowhere but at a port of its own."""
    zenoh.init_log_from_env_or("off")
    config = zenoh.Config()
    settings = {
        "mode": "peer",
        "scouting/multicast/enabled": False,
        "listen/endpoints": ["tcp/127.0.0.1:0"],
        "connect/endpoints": [endpoint],
        "connect/exit_on_failure": False,
        "connect/timeout_ms": -1,
    }
    for key, value in settings.items():
        config.insert_json5(key, json.dumps(value))
    return zenoh.open(config)


@cache
def _observer() -> Identity | None:
    """Return the identity of an observer, who may hear everything and order nothing; None on an open bus."""
    operator = os.environ.get(IDENTITY_VARIABLE)
    return Identity.load(Path(operator).parent / "observer.main") if operator else None


def _session() -> zenoh.Session:
    observer = _observer()
    return zenoh.open(secured_client(observer, _ENDPOINT, PATIENCE_S)) if observer else peer(_ENDPOINT)


def _asked(name: str) -> str:
    """Return the key of a request."""
    observer = _observer()
    return asked_key(_key(name), observer.name if observer else "")


def _key(name: str) -> str:
    return f"{_NAMESPACE}/{name}"


def _stay(*_held: object) -> None:
    """Stay for good, with what is held."""
    _begun()
    while True:
        time.sleep(60.0)


# -- readers ---------------------------------------------------------------------------------------------------------


def _slow_reader() -> None:
    """Subscribes to everything and never takes a sample."""
    session = _session()
    _stay(session.declare_subscriber(f"{_NAMESPACE}/**", handlers.FifoChannel(1)))


# -- floods ----------------------------------------------------------------------------------------------------------


def _flood(names: list[str], payload: bytes) -> None:
    """Ask as fast as it goes, under a new request id each time where the payload has the placeholder for one."""
    session, chance = _session(), random.Random(os.getpid())
    _begun()
    while True:
        for name in names:
            asked = payload.replace(_PLACEHOLDER, f"{chance.getrandbits(128):032x}".encode(), 1)
            _ask(session, name, asked)


def _ask(session: zenoh.Session, name: str, payload: bytes) -> None:
    session.get(
        _asked(name),
        lambda _reply: None,
        payload=payload,
        encoding=zenoh.Encoding("application/cdr"),
        target=zenoh.QueryTarget.ALL,
        congestion_control=zenoh.CongestionControl.BLOCK,
        timeout=2.0,
    )


def _flood_paint() -> None:
    _flood([topics.GET_PAINT.name], encode(m.GetPaintRequest(request_id=_PLACEHOLDER.decode())))


def _flood_load() -> None:
    trajectory = _straight(2)
    _flood([topics.LOAD.name], encode(m.LoadRequest(request_id=_PLACEHOLDER.decode(), trajectory=trajectory)))


def _flood_large_load() -> None:
    """Loads of 9.7 MB: a trajectory of as many segments as that takes, which takes 20 s to make and is kept."""
    kept = Path(os.environ.get(KEEP_VARIABLE, tempfile.gettempdir())) / "large-load.cdr"
    if not kept.exists():
        few = 100
        of_few = len(encode(m.LoadRequest(trajectory=_straight(few))))
        trajectory = _straight(few * _LARGE_BYTES // of_few)
        made = kept.with_suffix(f".{os.getpid()}")
        made.write_bytes(encode(m.LoadRequest(request_id=_PLACEHOLDER.decode(), trajectory=trajectory)))
        made.rename(kept)
    _flood([topics.LOAD.name], kept.read_bytes())


def _flood_repeated_keys() -> None:
    """Loads with 1.1 MB of JSON in which many keys are there twice."""
    names = [f"k{number}" for number in range(_REPEATED_KEYS_BYTES // 22)]
    text = "{" + ",".join(f'"{name}":0' for name in [*names, *names]) + "}"
    request = m.LoadRequest(request_id=_PLACEHOLDER.decode(), trajectory=_straight(2), template_json=text)
    _flood([topics.LOAD.name], encode(request))


def _flood_diagnostics() -> None:
    names = [topics.diagnostics_service(node).name for node in (topics.ROBOT_SIM, topics.BRIDGE, topics.PLANNER)]
    _flood(names, encode(m.GetDiagnosticsRequest(request_id=_PLACEHOLDER.decode())))


def _flood_speed() -> None:
    factor = float(os.environ.get(SPEED_VARIABLE, "1"))
    _flood([topics.SET_SPEED.name], encode(m.SetSpeedRequest(request_id=_PLACEHOLDER.decode(), factor=factor)))


def _flood_estop() -> None:
    """Repeats of one e-stop: it is to act once, and never again after the reset."""
    _flood([topics.ESTOP.name], encode(m.CommandRequest(request_id=f"stranger-{os.getpid()}")))


def _flood_junk() -> None:
    """Random bytes on every topic, and to every service."""
    session, chance = _session(), random.Random(os.getpid())
    publishers = [session.declare_publisher(_key(topic.name)) for topic in topics.TOPICS]
    _begun()
    while True:
        for publisher in publishers:
            publisher.put(_junk(chance))
        for service in topics.SERVICES:
            _ask(session, service.name, _junk(chance))


def _junk(chance: random.Random) -> bytes:
    """Up to 4 kB, half of the time behind a CDR header."""
    head = b"\x00\x01\x00\x00" if chance.random() < 0.5 else b""
    return head + chance.randbytes(chance.randrange(4096))


def _straight(segments: int) -> Trajectory:
    """A line to the east in so many pieces of 0.1 m."""
    length_m = 0.1
    pieces = (segment(f"s{i}", Curve(length_m * i, 0.0, 0.0, 0.0, length_m)) for i in range(segments))
    speeds = ((0.0, 0.0), (length_m * segments / 2, 0.1), (length_m * segments, 0.0))
    return assemble(pieces, [(0.0, Actuation.NONE)], (velocity(s, v) for s, v in speeds))


# -- crowds ----------------------------------------------------------------------------------------------------------


def _idle_connections() -> None:
    """Connects to the meeting point hundreds of times and says nothing; what is closed is opened anew."""
    _, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
    host, port = _ENDPOINT.rpartition("/")[2].rsplit(":", 1)
    held = [_connection(host, int(port)) for _ in range(_CONNECTIONS)]
    _begun()
    while True:
        held = [
            connection if connection is not None and _open(connection) else _connection(host, int(port))
            for connection in held
        ]
        time.sleep(0.01)


def _connection(host: str, port: int) -> socket.socket | None:
    connection = socket.socket()
    connection.setblocking(False)
    try:
        connection.connect((host, port))
    except BlockingIOError:
        return connection  # on its way
    except OSError:
        connection.close()
        return None
    return connection


def _open(connection: socket.socket) -> bool:
    try:
        said = connection.recv(4096)
    except BlockingIOError:
        return True
    except OSError:
        said = b""
    if not said:
        connection.close()
    return bool(said)


def _many_peers() -> None:
    """Two dozen honest peers that only are there."""
    _stay([_session() for _ in range(_PEERS)])


# -- impostors -------------------------------------------------------------------------------------------------------


def _rogue_tokens() -> None:
    """Liveliness tokens that are not what they should be, and one in the robot's name."""
    session = _session()
    prefix = f"@touchline/{_NAMESPACE}"
    robot = f"/{topics.ROBOT_SIM}/0"
    names = ("", "/x", robot, f"{robot}/1", "/" + "n" * 300 + "/0", "/\x1b]52;c;eA==\a/0")
    _stay([session.liveliness().declare_token(prefix + name) for name in names])


def _rogue_answers() -> None:
    """Answers for the planner and the robot: done, all is well."""
    session = _session()
    fake = encode(m.CommandResponse(success=True, message=f"{IMPOSTOR} done"))
    answers = {
        topics.PLAN_SERVICE.name: encode(
            m.PlanResponse(success=True, message=f"{IMPOSTOR} plan", trajectory=_straight(2))
        ),
        **{service.name: fake for service in (topics.ESTOP, topics.PAUSE, topics.START, topics.RESET)},
    }
    _stay([_impostor(session, name, payload) for name, payload in answers.items()])


def _impostor(session: zenoh.Session, name: str, payload: bytes) -> object:
    """A queryable that answers `name` with `payload`, for as long as it is held."""

    def answer(query: zenoh.Query) -> None:
        with query:
            query.reply(_key(name), payload, encoding=zenoh.Encoding("application/cdr"))

    return session.declare_queryable(_key(name), answer, complete=True)


def _rogue_wildcards() -> None:
    """One query to all commands at once."""
    session = _session()
    _begun()
    while True:
        _ask(session, "traversal/*", encode(m.CommandRequest(request_id=f"stranger-{time.time_ns()}")))
        time.sleep(0.2)


def _rogue_numbers() -> None:
    """Messages in the name of the true publishers, far ahead in number and not to be decoded, and some without name."""
    session = _session()
    ids: dict[str, bytes] = {}

    def note(sample: zenoh.Sample) -> None:
        if sample.attachment is not None:
            ids[str(sample.key_expr)] = sample.attachment.to_bytes()[-16:]

    _listening = session.declare_subscriber(f"{_NAMESPACE}/**", note)
    time.sleep(0.5)
    _begun()
    own, ahead = os.urandom(16), 2**62
    while True:
        for topic in topics.RECORDED:
            key = _key(topic.name)
            payload = b"\x00\x01\x00\x00" + os.urandom(3)
            for publisher in (ids.get(key, own), own):
                session.put(key, payload, attachment=_ATTACHMENT.pack(ahead, time.time_ns(), 16, publisher))
            session.put(key, payload)
            ahead += 1000
        time.sleep(0.05)


def _rogue_diagnostics() -> None:
    """Diagnostics of all services that lack everything, lie, or are not to be read."""
    session = _session()
    nodes = (topics.ROBOT_SIM, topics.BRIDGE, topics.PLANNER)
    lies = (m.KeyValue(key="pid", value="1"), m.KeyValue(key="published", value="many"))
    statuses = [
        m.DiagnosticStatus(level=level, name=node, message="\x1b[2Jgone", values=values)
        for node in (*nodes, "")
        for level, values in ((0, ()), (2, lies))
    ]
    reports = [encode(m.DiagnosticArray()), *(encode(m.DiagnosticArray(status=(status,))) for status in statuses)]
    empty = encode(m.GetDiagnosticsResponse())
    _serving = [_impostor(session, topics.diagnostics_service(node).name, empty) for node in nodes]
    _begun()
    own, number = os.urandom(16), 0
    while True:
        for report in reports:
            number += 1
            attachment = _ATTACHMENT.pack(number, time.time_ns(), 16, own)
            session.put(_key(topics.DIAGNOSTICS.name), report, attachment=attachment)
        time.sleep(0.02)


ROLES: Final[dict[str, Callable[[], None]]] = {
    "slow-reader": _slow_reader,
    "flood-paint": _flood_paint,
    "flood-load": _flood_load,
    "flood-load-9.7MB": _flood_large_load,
    "flood-load-keys": _flood_repeated_keys,
    "flood-diagnostics": _flood_diagnostics,
    "flood-speed": _flood_speed,
    "flood-estop": _flood_estop,
    "flood-junk": _flood_junk,
    "idle-connections": _idle_connections,
    "many-peers": _many_peers,
    "rogue-tokens": _rogue_tokens,
    "rogue-answers": _rogue_answers,
    "rogue-wildcards": _rogue_wildcards,
    "rogue-numbers": _rogue_numbers,
    "rogue-diagnostics": _rogue_diagnostics,
}

if __name__ == "__main__":
    main()
