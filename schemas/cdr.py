"""CDR encoding and decoding of messages as in ROS 2, and RIHS01 type hashes.

rosbags does the encoding; its serialiser reads attributes by name and so takes the models directly.
"""

from functools import cache
from importlib.resources import files
from importlib.resources.abc import Traversable
from typing import Any, TypeVar, cast

from pydantic import ValidationError
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from touchline.schemas.errors import PayloadError
from touchline.schemas.messages.base import Message

M = TypeVar("M", bound=Message)

#: Larger payloads are refused unread: the largest honest message, a trajectory of 100,000 segments, stays below.
MAX_PAYLOAD_BYTES = 32 * 1024 * 1024
#: Folders of shipped definitions: our own packages, and services of ROS 2's packages, which rosbags does not know.
OWN, STANDARD = "msg", "standard_msg"
#: What introspection events begin with; the hash of every service depends on it.
EVENT_INFO = "service_msgs/msg/ServiceEventInfo"
_CLIENT_GID: Any = (Nodetype.ARRAY, ((Nodetype.BASE, ("uint8", 0)), 16))


def definition_files(folder: str = OWN) -> list[tuple[str, str]]:
    """The shipped message definitions as (ROS type, text); a service gives its request and its response.

    Args:
        folder: `OWN` or `STANDARD`.
    """
    found: list[tuple[str, str]] = []
    for package in sorted((files("touchline.schemas") / folder).iterdir(), key=lambda entry: entry.name):
        if package.is_dir():
            found += _package_definitions(package)
    return found


def _package_definitions(package: Traversable) -> list[tuple[str, str]]:
    found: list[tuple[str, str]] = []
    for folder in sorted((entry for entry in package.iterdir() if entry.is_dir()), key=lambda entry: entry.name):
        for entry in sorted(folder.iterdir(), key=lambda entry: entry.name):
            name = f"{package.name}/{folder.name}/{entry.name.rsplit('.', 1)[0]}"
            text = entry.read_text(encoding="utf-8")
            if folder.name == "srv":
                request, response = text.split("---\n", 1)
                found += [(f"{name}_Request", request), (f"{name}_Response", response)]
            else:
                found.append((name, text))
    return found


class _Classes(dict[str, type]):
    """Python classes of types, each made when it is first asked for: no process needs all, and each takes 0.5 ms.

    Args:
        known: Classes of the types that rosbags brings.
        shipped: Definitions of the shipped types.
    """

    def __init__(self, known: dict[str, type], shipped: dict[str, Any]) -> None:
        super().__init__(known)
        self._shipped = shipped

    def __missing__(self, name: str) -> type:
        """Make the class of a shipped type."""
        store = get_typestore(Stores.EMPTY)
        store.register({name: self._shipped[name]})
        self[name] = store.types[name]
        return self[name]


@cache
def typestore() -> Typestore:
    """Standard ROS 2 types and the shipped ones."""
    store = get_typestore(Stores.ROS2_JAZZY)
    types: dict[str, Any] = {}
    for name, text in (*definition_files(STANDARD), *definition_files()):
        # The parser knows messages only; a request or response is one under its service's name.
        (types[name],) = get_types_from_msg(text, name.replace("/srv/", "/msg/")).values()
    store.types = _Classes(store.types, types)
    store.fielddefs = {**types, **store.fielddefs}
    # In a .msg file ``char`` is another name of uint8, also in the hash; rosbags takes it for IDL's.
    constants, fields = store.fielddefs[EVENT_INFO]
    told = [(name, _CLIENT_GID if name == "client_gid" else kind) for name, kind in fields]
    store.fielddefs[EVENT_INFO] = (constants, told)
    return store


def encode(message: Message) -> bytes:
    """Little-endian CDR with its 4-byte header: the bytes that ROS 2 would send."""
    return bytes(typestore().serialize_cdr(message, message.ros_type))


def decode(kind: type[M], payload: bytes) -> M:
    """The message in ``payload``.

    Raises:
        PayloadError: It is too large, truncated, over-long, or its values are not allowed in ``kind``.
    """
    raw = decode_structure(kind, payload)
    try:
        return kind.model_validate(raw)
    except ValidationError as error:
        first = error.errors()[0]
        field = ".".join(str(part) for part in first["loc"])
        raise PayloadError(f"{kind.ros_type}: {field}: {first['msg']}") from error


def decode_structure(kind: type[Message], payload: bytes) -> object:
    """The fields in ``payload`` as rosbags reads them, whatever their values.

    Raises:
        PayloadError: It is too large, truncated or over-long.
    """
    if len(payload) > MAX_PAYLOAD_BYTES:
        raise PayloadError(
            f"{kind.ros_type}: payload of {len(payload):,} bytes; at most {MAX_PAYLOAD_BYTES:,} are read"
        )
    if len(payload) < 4 or payload[0] != 0 or payload[1] not in (0, 1):
        raise PayloadError(f"{kind.ros_type}: payload of {len(payload)} bytes does not begin with a CDR header")
    try:
        return typestore().deserialize_cdr(payload, kind.ros_type)
    except Exception as error:  # the generated decoder raises whatever the bytes lead it into
        raise PayloadError(
            f"{kind.ros_type}: not a CDR message of this type ({str(error) or type(error).__name__})"
        ) from error


def first_string(payload: bytes) -> str:
    """The string that a CDR message begins with, without decoding the rest; empty if there is none."""
    if len(payload) < 8 or payload[0] != 0 or payload[1] not in (0, 1):
        return ""
    length = int.from_bytes(payload[4:8], "little" if payload[1] else "big")
    return payload[8 : 8 + length].rstrip(b"\0").decode(errors="replace") if length <= len(payload) - 8 else ""


@cache
def type_hash(kind: type[Message]) -> str:
    """The RIHS01 hash of a message type (ROS REP-2016), such as ``RIHS01_7d9a…``."""
    return typestore().hash_rihs01(kind.ros_type)


@cache
def service_type_hash(ros_type: str) -> str:
    """The RIHS01 hash of a service type such as ``touchline_msgs/srv/Plan``.

    It is that of a message that holds request, response and introspection event (rosidl's description of a service).
    """
    request, response, event = (f"{ros_type}_{part}" for part in ("Request", "Response", "Event"))
    descriptions = Typestore()
    descriptions.fielddefs = {
        **typestore().fielddefs,
        event: (
            [],
            [
                ("info", (Nodetype.NAME, EVENT_INFO)),
                ("request", (Nodetype.SEQUENCE, ((Nodetype.NAME, request), 1))),
                ("response", (Nodetype.SEQUENCE, ((Nodetype.NAME, response), 1))),
            ],
        ),
        ros_type: (
            [],
            [
                ("request_message", (Nodetype.NAME, request)),
                ("response_message", (Nodetype.NAME, response)),
                ("event_message", (Nodetype.NAME, event)),
            ],
        ),
    }
    return descriptions.hash_rihs01(ros_type)


@cache
def full_definition(kind: type[Message]) -> str:
    """The ``ros2msg`` schema text: the type's definition followed by those of all types in it."""
    text, _ = typestore().generate_msgdef(kind.ros_type, ros_version=2)
    return text


def flat_fields(ros_type: str, prefix: str = "") -> list[tuple[str, str, int | None]]:
    """The leaves of a type in wire order.

    Returns:
        (dotted path, primitive type, count) each; count is ``None`` for a scalar, the length of a fixed array, and
        −1 for a sequence.

    Raises:
        TypeError: The type holds an array of messages, which has no flat form.
    """
    leaves: list[tuple[str, str, int | None]] = []
    for name, description in typestore().fielddefs[ros_type][1]:
        node, detail = description
        path = f"{prefix}{name}"
        if node == Nodetype.NAME:
            leaves += flat_fields(str(detail), f"{path}.")
        elif node == Nodetype.BASE:
            leaves.append((path, str(detail[0]), None))
        else:
            (inner, inner_detail), count = cast("tuple[tuple[Nodetype, Any], int]", detail)
            if inner != Nodetype.BASE:
                raise TypeError(f"{ros_type}.{path} is an array of messages")
            leaves.append((path, str(inner_detail[0]), int(count) if node == Nodetype.ARRAY else -1))
    return leaves


NUMPY_CODES = {
    "bool": "?",
    "byte": "B",
    "char": "B",
    "int8": "b",
    "uint8": "B",
    "int16": "h",
    "uint16": "H",
    "int32": "i",
    "uint32": "I",
    "int64": "q",
    "uint64": "Q",
    "float32": "f",
    "float64": "d",
}
