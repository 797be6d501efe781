"""Messages from the coordinator to a robot at a tick of sim time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from touchline.schemas import messages as m
from touchline.schemas.messages.team_messages import NOTHING_HEARD_S

_MAP: Final = "map"


def header_at(tick: int) -> m.Header:
    """Return the header of a coordinator's message at a tick of sim time."""
    return m.Header(stamp=m.Time(sec=tick // 100, nanosec=tick % 100 * 10_000_000), frame_id=_MAP)


def stamped_guidance(guidance: Sequence[m.Guidance], tick: int) -> list[m.Guidance]:
    """Stamp a robot's guidance for a tick; without any, return a bare acknowledgement."""
    head = header_at(tick)
    return [each.model_copy(update={"header": head}) for each in guidance or [m.Guidance(echo_s=NOTHING_HEARD_S)]]
