"""Limits on size and length of a part of a recording."""

from dataclasses import dataclass
from typing import Final

from touchline.recordings.recording_file import RecordingError

#: A part begins with the schemas of all topics, some 50 kB; smaller limits would leave no room for messages.
LEAST_BYTES: Final = 1_000_000
LEAST_S: Final = 1.0


@dataclass(frozen=True)
class PartLimits:
    """Limits at which the next part begins.

    Attributes:
        max_bytes: File size, give or take half a second of data; 0: no limit.
        max_s: Sim time in the file (s); 0: no limit.

    Raises:
        RecordingError: A limit is below the least one.
    """

    max_bytes: int = 0
    max_s: float = 0.0

    def __post_init__(self) -> None:
        if 0 < self.max_bytes < LEAST_BYTES:
            raise RecordingError(f"max_bytes: parts of {self.max_bytes:,} bytes; give at least {LEAST_BYTES:,}, or 0")
        if not (self.max_s == 0.0 or LEAST_S <= self.max_s < float("inf")):
            raise RecordingError(f"max_s: parts of {self.max_s:g} s; give at least {LEAST_S:g}, or 0")

    def reached(self, size_bytes: int, span_s: float) -> bool:
        """Return whether a part of that size and sim time is to end."""
        return bool((self.max_bytes and size_bytes >= self.max_bytes) or (self.max_s and span_s >= self.max_s))


UNLIMITED: Final = PartLimits()
