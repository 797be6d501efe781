"""Our CDR against that of Cyclone DDS's Python part (pycdr2): every type of every topic and service, both ways."""

import math
import random
import types
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import pytest
from pycdr2 import IdlStruct
from pycdr2 import types as idl
from rosbags.interfaces import Nodetype

from touchline.schemas import topics
from touchline.schemas.cdr import decode, encode, typestore
from touchline.schemas.messages import Message

KINDS: dict[str, type[Message]] = {topic.type.ros_type: topic.type for topic in (*topics.TOPICS, *topics.VIEWING)}
for service in (*topics.SERVICES, topics.FOLLOWER_STEP):
    KINDS |= {kind.ros_type: kind for kind in (service.request, service.response)}
#: Largest number drawn: single bytes are enumerations, and the nanoseconds among the others end here.
LARGEST = {"int8": 1, "uint8": 1, "byte": 1, "int16": 2**15 - 1, "uint16": 2**16 - 1}
LARGEST |= {"int32": 2**31 - 1, "uint32": 10**9 - 1, "int64": 2**63 - 1, "uint64": 2**64 - 1}


@cache
def theirs(name: str) -> Any:
    """Their class of a ROS type."""
    annotations = {field: _their_type(*kind) for field, kind in typestore().fielddefs[name][1]}
    identifier = name.replace("/", "_")
    made = types.new_class(
        identifier, (IdlStruct,), {"typename": identifier}, lambda space: space.update(__annotations__=annotations)
    )
    return dataclass(made)


def _their_type(kind: Nodetype, detail: Any) -> Any:
    if kind == Nodetype.NAME:
        return theirs(detail)
    if kind == Nodetype.BASE:
        return {"string": str, "bool": bool, "byte": idl.uint8, "char": idl.uint8}.get(detail[0]) or getattr(
            idl, detail[0]
        )
    (inner, inner_detail), count = detail
    of = _their_type(inner, inner_detail)
    if kind == Nodetype.ARRAY:
        return idl.array[of, count]
    return idl.sequence[of, count] if count else idl.sequence[of]


def invented(name: str, draw: random.Random) -> dict[str, Any]:
    """Plain values for every field of a ROS type, with sequences of all lengths up to three."""
    return {field: _invented(*kind, draw) for field, kind in typestore().fielddefs[name][1]}


def _invented(kind: Nodetype, detail: Any, draw: random.Random) -> Any:
    if kind == Nodetype.NAME:
        return invented(detail, draw)
    if kind == Nodetype.BASE:
        return _primitive(detail[0], draw)
    (inner, inner_detail), count = detail
    length = count if kind == Nodetype.ARRAY else draw.randint(0, min(count or 3, 3))
    return [_invented(inner, inner_detail, draw) for _ in range(length)]


def _primitive(name: str, draw: random.Random) -> Any:
    if name == "string":
        return "".join(draw.choices("abcxyz σ€", k=draw.randint(0, 9)))
    if name == "bool":
        return draw.random() < 0.5
    if name.startswith("float"):
        value = draw.uniform(-1e6, 1e6)
        return float(np.float32(value)) if name == "float32" else value
    return draw.randint(0, LARGEST[name])


def _built(name: str, values: dict[str, Any]) -> Any:
    """Their object with ``values``."""
    made = {}
    for field, (kind, detail) in typestore().fielddefs[name][1]:
        value = values[field]
        if kind == Nodetype.NAME:
            value = _built(detail, value)
        elif kind != Nodetype.BASE and detail[0][0] == Nodetype.NAME:
            value = [_built(detail[0][1], each) for each in value]
        made[field] = value
    return theirs(name)(**made)


def within_a_turn(value: Any) -> Any:
    """The values with the goals' headings where they are taken: within a turn."""
    if isinstance(value, list):
        return [within_a_turn(each) for each in value]
    if not isinstance(value, dict):
        return value
    turned = {name: within_a_turn(each) for name, each in value.items()}
    if "heading_rad" in turned and "x_m" in turned:
        turned["heading_rad"] = math.remainder(turned["heading_rad"], 6.0)
    return turned


@pytest.mark.parametrize("name", sorted(KINDS))
def test_the_bytes_are_the_same_and_each_reads_the_other(name: str) -> None:
    draw = random.Random(name)
    for _ in range(10):
        values = within_a_turn(invented(name, draw))
        message, other = KINDS[name].model_validate(values), _built(name, values)
        assert encode(message) == other.serialize()
        assert theirs(name).deserialize(encode(message)) == other
        assert decode(KINDS[name], other.serialize()) == message
