"""Bytes of bundles of messages between regions and robots: JSON, and the samples of all plans behind it."""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np

from touchline.coordination.regions import region_messages as r
from touchline.core.timed_motion import COLUMNS

_LENGTH: Final = struct.Struct("<I")
_KINDS: Final = (
    r.RegionLife,
    r.RobotClaims,
    r.ClaimsAnswer,
    r.HandoverOffer,
    r.HandoverAccept,
    r.ClaimsRequest,
    r.AllClaims,
    r.OwnerOrder,
    r.PlanOrder,
    r.OwnedState,
    r.Letter,
)
_NUMBERS: Final = {kind: number for number, kind in enumerate(_KINDS)}
_PLAN: Final = len(_KINDS)
_PLANS: Final = _PLAN + 1
_SEQUENCE: Final = _PLAN + 2


def encode_bundle(messages: Sequence[Any]) -> bytes:
    """Return the bytes of messages of `region_messages`, or of tuples of these and of plain values."""
    plans: dict[int, tuple[int, r.TimedPlan]] = {}
    text = json.dumps([_plain(each, plans) for each in messages], separators=(",", ":")).encode()
    samples = [plan.samples.tobytes() for _, plan in plans.values()]
    return b"".join((_LENGTH.pack(len(text)), text, *samples))


def _plain(value: Any, plans: dict[int, tuple[int, r.TimedPlan]]) -> Any:
    """Return a value as JSON has it; each plan is put among the others once."""
    if isinstance(value, r.TimedPlan):
        if id(value) not in plans:
            last = next(reversed(plans.values()), None)
            plans[id(value)] = (0 if last is None else last[0] + last[1].samples.size, value)
        return [_PLAN, plans[id(value)][0], len(value.samples), value.start_s, value.branch_s]
    if isinstance(value, Mapping):
        return [_PLANS, *((number, _plain(plan, plans)) for number, plan in value.items())]
    if isinstance(value, tuple):
        return [_NUMBERS.get(type(value), _SEQUENCE), *(_plain(each, plans) for each in value)]
    return value


def decode_bundle(payload: bytes) -> list[Any]:
    """Return the messages of a bundle, which a process of ours has encoded."""
    (length,) = _LENGTH.unpack_from(payload)
    begin = _LENGTH.size + length
    numbers = np.frombuffer(payload, offset=begin).copy() if len(payload) > begin else np.zeros(0)
    plans: dict[int, r.TimedPlan] = {}
    return [_message(each, numbers, plans) for each in json.loads(payload[_LENGTH.size : begin])]


def _message(value: Any, numbers: np.ndarray[Any, Any], plans: dict[int, r.TimedPlan]) -> Any:
    if not isinstance(value, list):
        return value
    kind, *fields = value
    if kind == _PLAN:
        return _plan(fields, numbers, plans)
    if kind == _PLANS:
        return {number: _message(plan, numbers, plans) for number, plan in fields}
    parts = [_message(each, numbers, plans) for each in fields]
    return tuple(parts) if kind == _SEQUENCE else _KINDS[kind](*parts)


def _plan(fields: Sequence[Any], numbers: np.ndarray[Any, Any], plans: dict[int, r.TimedPlan]) -> r.TimedPlan:
    begin, rows, start_s, branch_s = fields
    if begin not in plans:
        samples = numbers[begin : begin + rows * COLUMNS].reshape(rows, COLUMNS)
        plans[begin] = r.TimedPlan(samples, start_s, branch_s)
    return plans[begin]
