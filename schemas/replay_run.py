"""Ids of publishers in a replay, which tell what messages belong together.

Within a topic messages come in order, across topics they need not. So the id of whoever publishes them tells which
replay they are of, and after how many of its jumps (seeks and new passes) they were sent.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Final

_MARK: Final = b"replay"
_RUN_BYTES: Final = 6
_JUMP_BYTES: Final = 4


@dataclass(frozen=True)
class ReplayRun:
    """Messages that a replay sends between two of its jumps.

    Attributes:
        key: Tells this replay from all others: 6 bytes.
        jumps: How often it has jumped before.
    """

    key: bytes
    jumps: int = 0

    @property
    def publisher_id(self) -> bytes:
        """Of the publisher of each topic: 16 bytes."""
        return _MARK + self.key + self.jumps.to_bytes(_JUMP_BYTES, "big")

    @classmethod
    def of_publisher(cls, publisher_id: bytes) -> ReplayRun | None:
        """The one whose publishers have this id; None if that is no replay's."""
        if not publisher_id.startswith(_MARK) or len(publisher_id) != len(_MARK) + _RUN_BYTES + _JUMP_BYTES:
            return None
        key = publisher_id[len(_MARK) : -_JUMP_BYTES]
        return cls(key, int.from_bytes(publisher_id[-_JUMP_BYTES:], "big"))

    def next(self) -> ReplayRun:
        """After another jump."""
        return ReplayRun(self.key, self.jumps + 1)


class Belonging(Enum):
    """Replay and jump that a message's publisher names."""

    LIVE = "live"
    """It is no replay's."""
    NOW = "now"
    """It belongs to what is known."""
    VOID = "void"
    """It was sent before a jump in time of which more is known already."""
    JUMP = "jump"
    """It is the first one after a jump: what was known is void."""


@dataclass
class ReplayFollower:
    """Tells of messages as they come whether they still count.

    Attributes:
        run: What the messages that count belong to; None while none of a replay has come.
    """

    run: ReplayRun | None = None

    def hear(self, publisher_id: bytes) -> Belonging:
        """A message of this publisher has come."""
        heard = ReplayRun.of_publisher(publisher_id)
        if heard is None:
            return Belonging.LIVE
        known, same = self.run, self.run is not None and self.run.key == heard.key
        if same and known is not None and heard.jumps <= known.jumps:
            return Belonging.NOW if heard.jumps == known.jumps else Belonging.VOID
        self.run = heard
        return Belonging.NOW if known is None else Belonging.JUMP
