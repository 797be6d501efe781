"""What a recording proves of the stops in it: no valve, no paint and no moving wheel after them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Final

from schemas import topics
from schemas.cdr import decode
from schemas.errors import PayloadError, TouchlineError
from schemas.messages import PaintMarks, SprayerState, TraversalStatus, WheelCommand
from schemas.messages.base import Message
from services.bridge.channels import topic_at
from services.bridge.reader import RecordingReader

_WATCHED: Final = (topics.STATUS, topics.SPRAYER, topics.PAINT, topics.WHEEL_COMMAND)
_CLOSING_NS: Final = 150_000_000
"""The valve's delay, and the tick that it is told in."""
_TELLING_NS: Final = 250_000_000
"""Paint is told ten times a second, and what was on its way out of the nozzle with it."""


def problems(path: Path) -> list[str]:
    """What is wrong in a recording: it cannot be read, does not decode, or paint or wheels go on after a stop."""
    try:
        heard = list(_messages(path))
    except (TouchlineError, OSError) as error:
        return [f"cannot be read: {error}"]
    found = [message for message in heard if isinstance(message, str)]
    timed = sorted((entry for entry in heard if not isinstance(entry, str)), key=lambda entry: entry[0])
    return sorted({*found, *_after_stops(timed)})


def opened_valve(found: list[str]) -> bool:
    """Whether it is among the problems that paint could flow after a stop."""
    return any("after a stop" in problem and "wheels" not in problem for problem in found)


def _messages(path: Path) -> Iterator[tuple[int, Message] | str]:
    reader = RecordingReader(path)
    for recorded in reader.messages():
        topic = topic_at(recorded.topic)
        if topic is None:
            yield f"{recorded.topic}: no topic of ours"
        elif topic in _WATCHED or recorded.sequence >= 2**31 or len(recorded.payload) < 8:
            try:
                yield recorded.log_time_ns, decode(topic.type, recorded.payload)
            except PayloadError:
                yield f"{topic.name}: recorded what does not decode"


def _after_stops(timed: list[tuple[int, Message]]) -> Iterator[str]:
    stopped_ns: int | None = None
    for time_ns, message in timed:
        if isinstance(message, TraversalStatus):
            if message.state != TraversalStatus.ESTOPPED:
                stopped_ns = None
            elif stopped_ns is None:
                stopped_ns = time_ns
        if stopped_ns is None:
            continue
        since_ns = time_ns - stopped_ns
        if isinstance(message, SprayerState) and (message.valve_open or message.valve_commanded):
            if since_ns > _CLOSING_NS:
                yield "valve open after a stop"
        elif isinstance(message, PaintMarks) and since_ns > _TELLING_NS:
            yield "paint after a stop"
        elif isinstance(message, WheelCommand) and since_ns > 0 and (message.left_radps or message.right_radps):
            yield "wheels commanded after a stop"
