"""What is known of a replay: where it is, and which of its messages still count."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

from touchline.schemas.messages.replay_messages import ReplayStatus
from touchline.schemas.replay_run import ReplayRun
from touchline.tui import format


class Belonging(Enum):
    """What the publisher of a message says about it."""

    LIVE = "live"
    """It is no replay's."""
    NOW = "now"
    """It belongs to what is known."""
    VOID = "void"
    """It was sent before a jump in time of which more is known already."""
    JUMP = "jump"
    """It is the first one after a jump: what was known is void."""


@dataclass
class ReplayView:
    """A replay as one of its robots' messages show it."""

    run: ReplayRun | None = None
    """What the messages that are known belong to."""
    status: ReplayStatus | None = None

    def hear(self, publisher: str) -> Belonging:
        """A message has come whose publisher has this id, in hexadecimal digits."""
        heard = _run_of(publisher)
        if heard is None:
            return Belonging.LIVE
        known, same = self.run, self.run is not None and self.run.key == heard.key
        if same and known is not None and heard.jumps <= known.jumps:
            return Belonging.NOW if heard.jumps == known.jumps else Belonging.VOID
        self.run = heard
        return Belonging.NOW if known is None else Belonging.JUMP

    @property
    def playing(self) -> bool:
        """Whether it goes on by itself."""
        return self.status is not None and self.status.playing

    @property
    def mark(self) -> str:
        """The mark that every screen bears."""
        status = self.status
        if status is None:
            return "REPLAY"
        speed = "max" if status.speed < 0.0 else format.factor(status.speed)
        end = "" if math.isnan(status.end_s) else f" of {format.duration(status.end_s)}"
        passes = "" if status.loops == 1 else f"  pass {status.loop}"
        doing = "►" if status.playing else "‖"
        return f"REPLAY {doing} {format.duration(status.now_s)}{end}  {speed}{passes}"


def _run_of(publisher: str) -> ReplayRun | None:
    try:
        return ReplayRun.of_publisher(bytes.fromhex(publisher))
    except ValueError:  # whoever made it up
        return None
