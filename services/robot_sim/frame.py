"""Format of the pipe from the control loop to the sender: messages one after another, each behind a header."""

from __future__ import annotations

import hashlib
import struct
from typing import Final

from touchline.schemas import topics

HEADER: Final = struct.Struct("<IHQ")
"""Bytes of the payload, number of robot and topic, sequence number."""

_OTHERS: Final = (
    topics.PLANNER_PROGRESS,
    topics.REPLAY_STATUS,
    topics.SUPERVISOR_EVENTS,
    topics.DIAGNOSTICS,
    topics.CLAIMED,
    topics.GUIDANCE,
    topics.TEAM_SETUP,
    topics.TEAM_CELLS,
    topics.TEAM_STATUS,
    topics.TEAM_QUEUE,
    topics.TEAM_REPORT,
    topics.TEAM_MEMORY,
)
CARRIED: Final = tuple(topic for topic in topics.TOPICS if topic not in _OTHERS)
"""Topics that the robot publishes through the sender."""
NUMBERS: Final = {topic.name: number for number, topic in enumerate(CARRIED)}
"""Numbers of the first robot's topics; those of the next one follow them."""


def publisher_id(run: str, key: str) -> bytes:
    """Return the id of the sender's publisher of a topic.

    Args:
        run: Id of the run of the robots' process.
        key: Key of the topic.
    """
    return hashlib.blake2b(f"{run} {key}".encode(), digest_size=16).digest()
