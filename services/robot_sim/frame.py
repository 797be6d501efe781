"""How messages lie in the pipe from the control loop to the sender: one after another, each behind a header."""

from __future__ import annotations

import struct
from typing import Final

from schemas import topics

HEADER: Final = struct.Struct("<IHQ")
"""Bytes of the payload, number of the topic, sequence number."""

CARRIED: Final = tuple(t for t in topics.TOPICS if t not in (topics.PLANNER_PROGRESS, topics.SUPERVISOR_EVENTS))
"""What the robot publishes."""
NUMBERS: Final = {topic.name: number for number, topic in enumerate(CARRIED)}
