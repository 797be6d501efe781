"""Targets of the fuzzers: each gives bytes to the entry points of a reader, which may raise Touchline's errors only."""

import atexit
import os
import shutil
import socket
import tempfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import closing, suppress
from functools import cache, partial
from itertools import islice
from pathlib import Path
from typing import Any

from touchline.bus import attachment
from touchline.checking.importing.import_logs import load_mapping
from touchline.checking.recorded_session import RecordedSession
from touchline.cli import settings_file
from touchline.drawings.geojson import read_geojson
from touchline.drawings.importer import import_drawing
from touchline.drawings.occupancy_map import load_map
from touchline.recordings import decoding
from touchline.recordings.attachments import attached_data
from touchline.recordings.channels import kind_of
from touchline.recordings.logs.formats import read_logs
from touchline.recordings.reader import RecordingReader, read_summary
from touchline.recordings.recorded import Damage, Recorded, RecordingKind
from touchline.recordings.recording_file import RecordingError
from touchline.recordings.replay.replay_source import ReplaySource
from touchline.recordings.salvage import salvage
from touchline.recordings.session_attachments import KEPT, SessionAttachments
from touchline.schemas import topics
from touchline.schemas.catalogue import load_template, load_vehicle
from touchline.schemas.cdr import decode, encode
from touchline.schemas.errors import PayloadError, TouchlineError
from touchline.schemas.faults import parse_fault
from touchline.schemas.fleet import Fleet
from touchline.schemas.messages import PoseStamped, RobotOrder, String
from touchline.schemas.messages.base import Message
from touchline.schemas.scenario import Scenario
from touchline.schemas.setup import Setup
from touchline.schemas.spec import parse, read_text
from touchline.schemas.team import TeamScenario
from touchline.schemas.wellformed import Wellformed
from touchline.services.bridge.foxglove.viewer_access import ViewerAccess
from touchline.services.bridge.foxglove.viewer_address import FoxgloveConfig
from touchline.services.bridge.foxglove.viewer_guard import refusal_of
from touchline.services.bridge.foxglove.viewer_server import ServedOrder, ViewerAnswers, ViewerServer
from touchline.services.bridge.goal_route import goal_of

CORPUS = Path(__file__).with_name("corpus")
#: Files here are in memory: to write one again on a disk's file system waits for the disk.
_MEMORY = Path("/dev/shm")
_CUES = 1000
_MOST_TYPES = 100
_ANSWERED_S = 5.0
_HANDSHAKE = b"\r\n".join(
    (
        b"GET / HTTP/1.1",
        b"Host: localhost",
        b"Upgrade: websocket",
        b"Connection: Upgrade",
        b"Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==",
        b"Sec-WebSocket-Version: 13",
        b"Sec-WebSocket-Protocol: foxglove.sdk.v1",
        b"\r\n",
    )
)


@cache
def folder() -> Path:
    """Folder of this process for the files that readers open, which goes when it ends."""
    made = Path(tempfile.mkdtemp(prefix="touchline-fuzz-", dir=_MEMORY if _MEMORY.is_dir() else None))
    atexit.register(shutil.rmtree, made, ignore_errors=True)
    return made


def _file(name: str, data: bytes) -> Path:
    path = folder() / name
    path.write_bytes(data)
    return path


def _forget_types() -> None:
    """Forget the types of earlier inputs before they fill the memory."""
    if decoding.decoder.cache_info().currsize > _MOST_TYPES:
        for cached in (decoding.decoder, decoding.layout, decoding._parsed):
            cached.cache_clear()


def read_cdr(data: bytes) -> None:
    """Decode a line with the name of a type, and a message; what is well-formed on the bus must be what is decoded."""
    name, _, payload = data.partition(b"\n")
    kinds = _kinds()
    kind = kinds.get(name.decode("latin-1")) or list(kinds.values())[zlib.crc32(name) % len(kinds)]
    try:
        decode(kind, payload)
        problem = ""
    except PayloadError as error:
        problem = str(error)
    assert bool(Wellformed(kind).problem(payload)) == bool(problem), problem


@cache
def _kinds() -> dict[str, type[Message]]:
    """Every message of the bus, by its ROS 2 type."""
    services = (*topics.SERVICES, *topics.PARAMETER_SERVICES, *topics.REPLAY_SERVICES, topics.TEAM_TASK)
    kinds = [each for service in services for each in (service.request, service.response)]
    return {kind.ros_type: kind for kind in (*(topic.type for topic in topics.TOPICS), *kinds)}


def read_attachment(data: bytes) -> None:
    """Read what comes with a message: an attachment of ROS 2, and texts that a recording keeps beside its messages."""
    attachment.unpack(data)
    attachment.is_intact(data[:37], zlib.crc32(data), data)
    kept = SessionAttachments("r1")
    for name in sorted(KEPT):
        kept.take(name, data)
    list(kept.attachments())
    with suppress(PayloadError):
        goal_of(decode(PoseStamped, data))


def read_recording(name: str, data: bytes) -> None:
    """Summarise, decode, replay and salvage a recording."""
    path, salvaged = _file(name, data), folder() / "salvaged.mcap"
    salvaged.unlink(missing_ok=True)
    for use in (_decode, _replay, partial(salvage, target=salvaged)):
        with suppress(TouchlineError):
            use(path)
    _forget_types()


def read_session(data: bytes) -> None:
    """Find the inputs of a session in lines of a topic, or the name of an order, and a text."""
    messages = []
    for number, line in enumerate(data.decode("utf-8", "replace").split("\n")):
        name, _, text = line.partition(" ")
        topic = topics.TOPIC_BY_NAME.get(name, topics.ORDERS)
        content = RobotOrder(name=name, details_json=text) if topic is topics.ORDERS else topic.type()
        payload = encode(String(data=text) if topic.type is String else content)
        messages.append(Recorded(f"/r1/{topic.name}", number, number, number, payload, kind_of(topic.type)))
    with suppress(TouchlineError):
        _ = RecordedSession.of(messages).loaded_ns


def _decode(path: Path) -> None:
    reader = RecordingReader(path)
    for message in reader.messages():
        _decode_as(message.kind, message.payload)
    for attached in reader.summary.attachments:
        with suppress(Damage, RecordingError):
            attached_data(attached)
    RecordingReader(path).tables(lambda topic: True)


def _decode_as(kind: RecordingKind, payload: bytes) -> None:
    decoding.layout(kind)
    read = decoding.decoder(kind)
    if read is not None:
        with suppress(Damage):
            read(payload)


def _replay(path: Path) -> None:
    with closing(ReplaySource(path)) as source:
        for _ in islice(source.from_start(), _CUES):
            pass
        _, ahead = source.jump(1.0)
        next(ahead, None)


def read_definition(data: bytes) -> None:
    """Read a definition of a message type, and a line with a payload before it."""
    payload, _, text = data.partition(b"\n")
    for form, encoding in (("ros2msg", "cdr"), ("ros2idl", "cdr"), ("ros1msg", "ros1")):
        kind = RecordingKind(encoding, "a/msg/A", form, text.decode("utf-8", "surrogateescape"))
        _decode_as(kind, b"\0\1\0\0" + payload)
    _forget_types()


def read_bag_folder(data: bytes) -> None:
    """Read a folder with this metadata.yaml."""
    metadata = _bag_folder() / "metadata.yaml"
    metadata.write_bytes(data)
    with suppress(TouchlineError):
        read_summary(metadata.parent)


@cache
def _bag_folder() -> Path:
    bag = folder() / "bag"
    bag.mkdir()
    (bag / "bag_0.mcap").touch()
    return bag


def read_log(name: str, data: bytes) -> None:
    """Read all streams of a log."""
    with suppress(TouchlineError):
        read_logs([_file(name, data)])
    _forget_types()


def read_drawing(name: str, data: bytes) -> None:
    """Import a drawing as a template."""
    with suppress(TouchlineError):
        import_drawing(_file(name, data))


def read_map(data: bytes) -> None:
    """Read a map of Nav2, whose image comes after its YAML and a line with three dashes."""
    text, _, image = data.partition(b"\n---\n")
    _file("given.pgm", image)
    with suppress(TouchlineError):
        load_map(_file("given.yaml", text))


def read_json(data: bytes) -> None:
    """Read a JSON file as everything that it could be."""
    path = _file("given.json", data)
    texts: list[Any] = [partial(parse, kind, source="given") for kind in (Scenario, Setup, TeamScenario)]
    for load in (load_template, load_vehicle, load_mapping, read_geojson, Fleet.read):
        with suppress(TouchlineError):
            load(path)
    for take in (*texts, parse_fault):
        with suppress(TouchlineError):
            take(text=read_text(path))


def read_settings(data: bytes) -> None:
    """Read a settings file."""
    os.environ[settings_file.FILE_VARIABLE] = str(_file("touchline.toml", data))
    try:
        settings_file.settings()
    except TouchlineError:
        pass
    finally:
        del os.environ[settings_file.FILE_VARIABLE]


def read_handshake(data: bytes) -> None:
    """Check the handshake of a viewer."""
    refusal_of(data, "localhost", ("https://viewer.example",), "token")


def hear_viewer(data: bytes) -> None:
    """Serve a viewer that sends messages, with empty lines between them: a letter, `t` for text, and the content."""
    host, port = _viewers()
    with socket.create_connection((host, port), _ANSWERED_S) as client:
        client.sendall(_HANDSHAKE)
        assert client.recv(12) == b"HTTP/1.1 101"
        with suppress(ConnectionError):  # the server may end it
            for message in data.split(b"\n\n"):
                client.sendall(_frame(1 if message[:1] == b"t" else 2, message[1:]))
            client.sendall(_frame(8, b"\x03\xe8"))
            while client.recv(65536):
                pass


def _frame(code: int, content: bytes) -> bytes:
    """Frame of a client, masked with zeros."""
    return bytes((0x80 | code, 0xFE)) + len(content).to_bytes(2, "big") + bytes(4) + content


@cache
def _viewers() -> tuple[str, int]:
    """Address of a server of viewers that may command a robot which refuses everything."""

    def order(service: topics.Service[Any, Any]) -> ServedOrder:
        def answer(payload: bytes) -> bytes:
            decode(service.request, payload)
            raise TouchlineError("refused")

        return ServedOrder(f"/r1/{service.name}", service, answer)

    answers = ViewerAnswers([order(each) for each in topics.SERVICES], lambda: {"r1.name": "a"}, lambda _: None)
    server = ViewerServer(FoxgloveConfig("127.0.0.1:0", orders=True), ViewerAccess(), answers)
    server.channel("/r1/tf", topics.TOPICS[0])
    server.restart((0, 1_000_000_000))
    return "127.0.0.1", int(server.url.rpartition(":")[2])


TARGETS: dict[str, Callable[[bytes], None]] = {
    "attachment": read_attachment,
    "bag": partial(read_log, "given.bag"),
    "bag-folder": read_bag_folder,
    "cdr": read_cdr,
    "csv": partial(read_log, "given.csv"),
    "definition": read_definition,
    "dxf": partial(read_drawing, "given.dxf"),
    "gpx": partial(read_log, "given.gpx"),
    "handshake": read_handshake,
    "json": read_json,
    "map": read_map,
    "mcap": partial(read_recording, "given.mcap"),
    "nmea": partial(read_log, "given.nmea"),
    "pos": partial(read_log, "given.pos"),
    "session": read_session,
    "settings": read_settings,
    "sqlite": partial(read_recording, "given.db3"),
    "svg": partial(read_drawing, "given.svg"),
    "ubx": partial(read_log, "given.ubx"),
    "viewer": hear_viewer,
}
"""By name, as is the folder of its corpus."""


def corpus(name: str) -> Iterator[Path]:
    """Files of a target's corpus."""
    return iter(sorted((CORPUS / name).iterdir()))
