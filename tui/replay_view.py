"""State of a replay: position, and validity of its messages."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from touchline.schemas.messages.replay_messages import ReplayStatus
from touchline.schemas.replay_run import Belonging, ReplayFollower, ReplayRun
from touchline.tui import format


@dataclass
class ReplayView:
    """Replay as seen through the messages of one of its robots."""

    followed: ReplayFollower = field(default_factory=ReplayFollower)
    status: ReplayStatus | None = None

    @property
    def run(self) -> ReplayRun | None:
        """Run of the replay that the present messages belong to."""
        return self.followed.run

    def hear(self, publisher: str) -> Belonging:
        """Classify a message by the id of its publisher, in hexadecimal digits."""
        try:
            return self.followed.hear(bytes.fromhex(publisher))
        except ValueError:  # an invalid id
            return Belonging.LIVE

    @property
    def playing(self) -> bool:
        """True if the replay plays."""
        return self.status is not None and self.status.playing

    @property
    def paused(self) -> bool:
        """True if the replay reports a pause."""
        return self.status is not None and not self.status.playing

    @property
    def mark(self) -> str:
        """Mark on every screen."""
        status = self.status
        if status is None:
            return "REPLAY"
        speed = "max" if status.speed < 0.0 else format.factor(status.speed)
        end = "" if math.isnan(status.end_s) else f" of {format.duration(status.end_s)}"
        passes = "" if status.loops == 1 else f"  pass {status.loop}"
        doing = "►" if status.playing else "‖"
        return f"REPLAY {doing} {format.duration(status.now_s)}{end}  {speed}{passes}"
