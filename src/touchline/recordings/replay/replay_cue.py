"""Message of a replay."""

from dataclasses import dataclass

from touchline.schemas.topics import Topic


@dataclass(frozen=True, slots=True)
class Cue:
    """Message of a robot to send ``at_s`` seconds after the first one; never less than that of the cue before."""

    at_s: float
    namespace: str
    topic: Topic
    payload: bytes
