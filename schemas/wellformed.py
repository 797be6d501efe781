"""Fast validation of CDR payloads, for every message on the bus."""

import struct
from collections.abc import Iterator
from typing import Any, NamedTuple, cast, get_args

from pydantic import AfterValidator
from rosbags.interfaces import Nodetype

from touchline.schemas.cdr import NUMPY_CODES, decode, decode_structure, typestore
from touchline.schemas.errors import PayloadError
from touchline.schemas.messages.base import Message

_HEADER_BYTES = 4
_COUNT = struct.Struct("<I")
_SECOND_NS = 1_000_000_000
#: Payloads up to this size are learnt from; larger ones are rare and decoded each time.
_LARGEST_LEARNT_BYTES = 8 * 1024
#: Sizes of payloads that are remembered.
_MOST_SIZES = 256
#: Of larger payloads (plans of thousands of segments) the structure is checked and not each value: that takes a fifth.
_LARGEST_CHECKED_BYTES = 256 * 1024


class _Skeleton(NamedTuple):
    """Marks of a payload of one type: ranges of the bytes that matter, and places of nanoseconds."""

    kept: tuple[tuple[int, int, bytes], ...]
    nanoseconds: tuple[int, ...]


class Wellformed:
    """Tells whether payloads are messages of one type.

    A payload is decoded in full unless it has the skeleton of one that was: the same texts, counts and flags at the
    same places, so that only numbers differ, of which any is allowed. Types that allow only some numbers are rare
    requests, and always decoded.

    Args:
        kind: The message type.
    """

    def __init__(self, kind: type[Message]) -> None:
        self._kind = kind
        self._known: dict[int, _Skeleton] = {}
        self._learns = not _has_validators(kind)

    def problem(self, payload: bytes) -> str:
        """Return the reason why ``payload`` is no message of the type; empty if it is one."""
        known = self._known.get(len(payload))
        if known is None:
            return self._decoded(payload)
        for begin, end, kept in known.kept:
            if payload[begin:end] != kept:
                return self._decoded(payload)
        for at in known.nanoseconds:
            if _COUNT.unpack_from(payload, at)[0] >= _SECOND_NS:
                return self._decoded(payload)
        return ""

    def _decoded(self, payload: bytes) -> str:
        try:
            if len(payload) > _LARGEST_CHECKED_BYTES:
                decode_structure(self._kind, payload)
            else:
                decode(self._kind, payload)
        except PayloadError as error:
            return str(error)
        little_endian = payload[:2] == b"\x00\x01"
        known = len(payload) in self._known or len(self._known) < _MOST_SIZES
        if self._learns and little_endian and known and len(payload) <= _LARGEST_LEARNT_BYTES:
            self._known[len(payload)] = _Walk(payload).skeleton(self._kind.ros_type)
        return ""


def _has_validators(kind: type[Message]) -> bool:
    """Return whether a field of the type, or of a message in it, allows only some values of its ROS 2 type."""
    return any(
        any(isinstance(each, AfterValidator) for each in field.metadata)
        or any(_has_validators(inner) for inner in _messages_in(field.annotation))
        for field in kind.model_fields.values()
    )


def _messages_in(annotation: Any) -> Iterator[type[Message]]:
    """Message types in an annotation such as ``tuple[Point, ...]``."""
    if isinstance(annotation, type) and issubclass(annotation, Message):
        yield annotation
    for part in get_args(annotation):
        yield from _messages_in(part)


class _Walk:
    """A walk through a payload that is known to be right, noting what is more than a number."""

    def __init__(self, payload: bytes) -> None:
        self._payload = payload
        self._at = _HEADER_BYTES
        self._kept = [(0, 2)]  # the other two bytes of the header are options, which nobody reads
        self._nanoseconds: list[int] = []

    def skeleton(self, ros_type: str) -> _Skeleton:
        self._message(ros_type)
        kept = tuple((begin, end, self._payload[begin:end]) for begin, end in self._kept)
        return _Skeleton(kept, tuple(self._nanoseconds))

    def _message(self, ros_type: str) -> None:
        for name, (node, detail) in typestore().fielddefs[ros_type][1]:
            if node == Nodetype.NAME:
                self._message(str(detail))
            elif node == Nodetype.BASE:
                self._scalar(name, str(detail[0]))
            else:
                inner, count = cast("tuple[tuple[Nodetype, Any], int]", detail)
                self._array(name, inner, count if node == Nodetype.ARRAY else self._count())

    def _array(self, name: str, inner: tuple[Nodetype, Any], count: int) -> None:
        node, detail = inner
        if node == Nodetype.BASE and detail[0] != "string":
            size = struct.calcsize(NUMPY_CODES[detail[0]])
            if count:
                self._align(size)
            self._at += count * size
            return
        for _ in range(count):
            if node == Nodetype.NAME:
                self._message(str(detail))
            else:
                self._scalar(name, str(detail[0]))

    def _scalar(self, name: str, primitive: str) -> None:
        if primitive == "string":
            self._keep(self._count())
            return
        size = struct.calcsize(NUMPY_CODES[primitive])
        self._align(size)
        if name == "nanosec":
            self._nanoseconds.append(self._at)
        if size == 1:  # flags and states, of which not every value is allowed
            self._keep(1)
        else:
            self._at += size

    def _count(self) -> int:
        self._align(_COUNT.size)
        count: int = _COUNT.unpack_from(self._payload, self._at)[0]
        self._keep(_COUNT.size)
        return count

    def _keep(self, size: int) -> None:
        begin, end = self._kept[-1]
        if end == self._at:
            self._kept[-1] = begin, end + size
        elif size:
            self._kept.append((self._at, self._at + size))
        self._at += size

    def _align(self, size: int) -> None:
        self._at += (_HEADER_BYTES - self._at) % size
