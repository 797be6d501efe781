"""Wall-clock times of a recording, whose messages have sim times."""

from collections.abc import Mapping
from datetime import UTC, datetime

#: Names of metadata records.
BEGUN, ENDED = "touchline_begun", "touchline_ended"
_KEY = "wall_time"
#: Log times from here on (September 2001) are of a wall clock: no session runs for so long.
_WALL_NS = 10**18


def wall_time_note(name: str) -> tuple[str, dict[str, str]]:
    """Return name and values of a metadata record that holds the present wall time."""
    return name, {_KEY: datetime.now(UTC).isoformat(timespec="milliseconds")}


def noted_wall_time(metadata: Mapping[str, Mapping[str, str]], name: str) -> str | None:
    """Return the last such time among metadata of one or several files; None if there is none."""
    found = [values[_KEY] for key, values in metadata.items() if key.split(" ")[0] == name and _KEY in values]
    if not found:
        return None
    return found[0] if name == BEGUN else found[-1]


def as_wall_time(time_ns: int) -> str | None:
    """Return that time, if it is one of a wall clock and of this millennium."""
    if not _WALL_NS <= time_ns < 4 * _WALL_NS:
        return None
    return datetime.fromtimestamp(time_ns / 1e9, UTC).isoformat(timespec="milliseconds")
