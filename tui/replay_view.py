"""What is known of a replay: where it is, and which of its messages still count."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from touchline.schemas.messages.replay_messages import ReplayStatus
from touchline.schemas.replay_run import Belonging, ReplayFollower, ReplayRun
from touchline.tui import format


@dataclass
class ReplayView:
    """A replay as one of its robots' messages show it."""

    followed: ReplayFollower = field(default_factory=ReplayFollower)
    status: ReplayStatus | None = None

    @property
    def run(self) -> ReplayRun | None:
        """What the messages that are known belong to."""
        return self.followed.run

    def hear(self, publisher: str) -> Belonging:
        """A message has come whose publisher has this id, in hexadecimal digits."""
        try:
            return self.followed.hear(bytes.fromhex(publisher))
        except ValueError:  # whoever made it up
            return Belonging.LIVE

    @property
    def playing(self) -> bool:
        """Whether it goes on by itself."""
        return self.status is not None and self.status.playing

    @property
    def paused(self) -> bool:
        """Whether it says that it stands still."""
        return self.status is not None and not self.status.playing

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
