"""Decoder of recorded payloads into trees of fields, by the schemas stored in the recording."""

import json
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields, is_dataclass
from functools import cache
from typing import Any, TypeVar

from pydantic import ValidationError
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from touchline.recordings.recorded import Damage, Recorded, RecordingKind
from touchline.recordings.type_extent import check_extent
from touchline.schemas.cdr import decode as decode_payload
from touchline.schemas.cdr import full_definition, typestore
from touchline.schemas.errors import PayloadError
from touchline.schemas.messages.base import Message
from touchline.schemas.topics import TOPICS, VIEWING

M = TypeVar("M", bound=Message)
Decode = Callable[[bytes], object]

#: Longest definition that is parsed: the longest of ROS 2's own have some 10,000 characters.
LONGEST_SCHEMA = 200_000
_DEEPEST = 32
_PARSED_FORMS = ("ros2msg", "ros1msg", "ros2idl", "omgidl", "msg", "idl", "")
#: Lines between the files of a definition (``IDL: std_msgs/msg/Header``), and those for a preprocessor.
_NO_IDL = re.compile(r"^(={10,}|IDL: .*|\s*#.*)$", re.MULTILINE)


def fields_of(node: object) -> Mapping[str, object] | None:
    """Return the fields of a message in a tree by name; None for a value."""
    if isinstance(node, dict):
        return node
    kind: Any = type(node)
    names = field_names(kind)
    return None if names is None else {name: getattr(node, name) for name in names}


@cache
def field_names(kind: type[Any]) -> tuple[str, ...] | None:
    """Return the field names of a decoded message; None for another value."""
    if not is_dataclass(kind):
        return None
    return tuple(field.name for field in fields(kind) if field.name != "__msgtype__")


@cache
def decoder(kind: RecordingKind) -> Decode | None:
    """Return a function that decodes payloads of that kind or raises :class:`Damage`; None for an unknown encoding."""
    if kind.encoding == "json":
        return _from_json
    store = _store(kind) if kind.encoding in ("cdr", "ros1") else None
    if store is None:
        return None
    name = full_name(kind.type)
    read: Callable[[bytes, str], object] = store.deserialize_cdr if kind.encoding == "cdr" else store.deserialize_ros1

    def decode(payload: bytes) -> object:
        if kind.encoding == "cdr" and (len(payload) < 4 or payload[0] != 0 or payload[1] not in (0, 1)):
            raise Damage("a payload that does not begin with a CDR header")
        try:
            return read(payload, name)
        except Exception as error:  # the generated decoder raises anything on bad bytes
            raise Damage(f"a payload that is no {name}") from error

    return decode


def as_message(form: type[M], message: Recorded) -> M:
    """Decode a message by its recording's own schema; fields that an older schema lacks get their defaults.

    Raises:
        PayloadError: It cannot be decoded, or its values are not allowed.
    """
    read = decoder(message.kind)
    if read is None:
        return decode_payload(form, message.payload)
    try:
        return form.model_validate(read(message.payload))
    except (Damage, ValidationError) as error:
        raise PayloadError(f"{message.topic}: not a {form.ros_type} ({error})") from error


@cache
def layout(kind: RecordingKind) -> dict[str, str] | None:
    """Return types of all fields of that kind by path (``pose.position.x``), in order; None if they are unknown."""
    store = _store(kind)
    return None if store is None else dict(_flat(store.fielddefs, full_name(kind.type), "", _DEEPEST))


def _flat(known: Mapping[str, Any], name: str, path: str, deepest: int) -> Iterator[tuple[str, str]]:
    for field, described in known[name][1]:
        many = described[0] in (Nodetype.ARRAY, Nodetype.SEQUENCE)
        (form, detail), count = described[1] if many else (described, 0)
        place = f"{path}{field}[{count or ''}]" if many else f"{path}{field}"
        if form == Nodetype.NAME and detail in known and deepest:
            yield from _flat(known, detail, f"{place}.", deepest - 1)
        else:
            yield place, str(detail[0] if form == Nodetype.BASE else detail)


def _from_json(payload: bytes) -> object:
    try:
        return json.loads(payload)
    except (ValueError, RecursionError) as error:
        raise Damage("a payload that is no JSON") from error


def full_name(name: str) -> str:
    """Return a type's name as in ROS 2: ``sensor_msgs/msg/Imu`` also for ROS 1's ``sensor_msgs/Imu``."""
    package, _, rest = name.partition("/")
    return name if "/" in rest or not rest else f"{package}/msg/{rest}"


@cache
def _ours() -> dict[str, str]:
    """Return the definitions of our topics' types, which need not be parsed."""
    return {topic.type.ros_type: full_definition(topic.type) for topic in (*TOPICS, *VIEWING)}


def _store(kind: RecordingKind) -> Typestore | None:
    """Return the types in a payload of that kind; None if they are unknown."""
    name = full_name(kind.type)
    if not kind.schema or kind.schema == _ours().get(name):
        return typestore() if name in typestore().fielddefs else None
    if kind.schema_encoding not in _PARSED_FORMS or len(kind.schema) > LONGEST_SCHEMA:
        return None
    return _parsed(name, kind.schema, kind.schema_encoding.endswith("idl"))


@cache
def _parsed(name: str, text: str, idl: bool) -> Typestore | None:
    """Parse the types in a definition; None if it is invalid."""
    store = get_typestore(Stores.EMPTY)
    try:
        _register(store, name, text, idl)
    except Damage:
        return None
    return store


def _register(store: Typestore, name: str, text: str, idl: bool) -> None:
    try:
        parsed = get_types_from_idl(_NO_IDL.sub("", text)) if idl else get_types_from_msg(text, name)
        found: dict[str, Any] = dict(parsed)
        described = {name: found[name], **_standard(found), **found}
        check_extent(described)
        store.register(described)
    except Damage:
        raise
    except Exception as error:  # the parser raises anything on bad text
        raise Damage(f"a schema that is no definition of {name}") from error


def _standard(found: Mapping[str, Any]) -> dict[str, Any]:
    """Return ROS 2's own definitions of the types that ``found`` uses and does not define."""
    known, needed = typestore().fielddefs, dict[str, Any]()
    open_ = list(found.values())
    while open_:
        for _, (form, detail) in open_.pop()[1]:
            kind, name = detail[0] if form in (Nodetype.ARRAY, Nodetype.SEQUENCE) else (form, detail)
            if kind == Nodetype.NAME and name not in found and name not in needed and name in known:
                needed[name] = known[name]
                open_.append(known[name])
    return needed
