"""The paint in a recording of one robot, or of one among others."""

from pathlib import Path

from touchline.jobs.single.recorded_paint import RecordedPaint, read_all_painted


def read_painted(path: Path, robot: str | None = None) -> RecordedPaint:
    """The last traversal."""
    (own,) = read_all_painted(path, robot).values()
    return own[-1]
