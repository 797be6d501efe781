"""What the coordinator sends to a robot at a tick of sim time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from touchline.schemas import messages as m
from touchline.schemas.messages.team_messages import NOTHING_HEARD_S

_MAP: Final = "map"


def header_at(tick: int) -> m.Header:
    """Of a message of the coordinator's at a tick of sim time."""
    return m.Header(stamp=m.Time(sec=tick // 100, nanosec=tick % 100 * 10_000_000), frame_id=_MAP)


def answers(told: Sequence[m.Guidance], tick: int) -> list[m.Guidance]:
    """What is sent to a robot that is told something at a tick, or nothing: then only that it is answered."""
    head = header_at(tick)
    return [each.model_copy(update={"header": head}) for each in told or [m.Guidance(echo_s=NOTHING_HEARD_S)]]
