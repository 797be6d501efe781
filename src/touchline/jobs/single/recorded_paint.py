"""Strokes, smears and reports of traversals, read from a recording."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from touchline.schemas import topics
from touchline.schemas.catalogue import parse_template
from touchline.schemas.cdr import decode
from touchline.schemas.errors import SpecError
from touchline.schemas.messages import AreaReport, PaintMarks, String, TraversalReport
from touchline.schemas.template import MAX_COORDINATE_M, Template
from touchline.schemas.topics import Topic

if TYPE_CHECKING:
    from touchline.recordings.recorded import Recorded

#: Largest number of points drawn: a day of painting.
MOST_POINTS = 10_000_000
FARTHEST_M = 2 * MAX_COORDINATE_M
WIDEST_M = 10.0


@dataclass(frozen=True)
class RecordedPaint:
    """Paint of a traversal, or ground of a tool that ``covers``; a recording cut off before its reports has none."""

    template: Template
    strokes: list[PaintMarks]
    report: TraversalReport | None
    area: AreaReport | None
    covers: bool


def read_all_painted(path: Path, robot: str | None = None) -> dict[str, list[RecordedPaint]]:
    """Read all traversals in the recording at ``path``, by namespace, of all robots or of one.

    Raises:
        RecordingError: The file cannot be read.
        SpecError: It holds no template of the robot, no paint or too much to be drawn.
        PayloadError: A message in it does not fit its topic.
    """
    from touchline.recordings.channels import namespace_at, topic_at
    from touchline.recordings.reader import RecordingReader

    found: dict[str, list[_Traversal]] = {}
    reader, points = RecordingReader(path), 0
    for message in reader.messages():
        topic, namespace = topic_at(message.topic), namespace_at(message.topic)
        if topic not in _OF_PAINT or robot not in (None, namespace):
            continue
        own = found.setdefault(namespace, [])
        if topic is topics.TEMPLATE or not own:
            own.append(_Traversal())
        points += own[-1].take(topic, message, path)
        if points > MOST_POINTS:
            raise SpecError(str(path), topics.PAINT.name, f"has more than {MOST_POINTS:,} points", "draw a shorter one")
    painted = {
        name: [_recorded(each, path) for each in own if each.template_json]
        for name, own in found.items()
        if own[-1].template_json
    }
    if not painted:
        ending = f", and is {reader.summary.problem}" if reader.summary.problem else ""
        whose = f" of robot {robot}" if robot is not None else ""
        problem = f"holds no template{whose}{ending}"
        raise SpecError(str(path), "", problem, "give the recording of a template's traversal")
    return painted


def _recorded(traversal: "_Traversal", path: Path) -> RecordedPaint:
    template = parse_template(traversal.template_json, f"the template in {path.name}", recorded=True)
    return RecordedPaint(template, joined(traversal.batches), traversal.report, traversal.area, traversal.covers)


_OF_PAINT: Final = (topics.TEMPLATE, topics.PAINT, topics.AREA, topics.AREA_REPORT, topics.REPORT)


@dataclass
class _Traversal:
    """Messages of a traversal that is being read."""

    template_json: str = ""
    batches: list[PaintMarks] = field(default_factory=list)
    report: TraversalReport | None = None
    area: AreaReport | None = None
    covers: bool = False

    def take(self, topic: Topic | None, message: "Recorded", path: Path) -> int:
        """Take a message; return its number of points."""
        from touchline.recordings.decoding import as_message

        if topic is topics.TEMPLATE:
            self.template_json = decode(String, message.payload).data
        elif topic is topics.REPORT:
            self.report = as_message(TraversalReport, message)
        elif topic is topics.AREA_REPORT:
            self.area = as_message(AreaReport, message)
        elif topic is topics.AREA:
            self.covers = True
        else:
            self.batches.append(_checked(decode(PaintMarks, message.payload), path))
            return len(self.batches[-1].x_m) + 1
        return 0


def _checked(marks: PaintMarks, path: Path) -> PaintMarks:
    """Return ``marks`` if they can be drawn.

    Raises:
        SpecError: They cannot.
    """
    drawable = (
        len(marks.x_m) == len(marks.y_m)
        and all(bool((np.abs(axis) <= FARTHEST_M).all()) for axis in (marks.x_m, marks.y_m))
        and 0.0 <= marks.width_m <= WIDEST_M
    )
    if not drawable:
        raise SpecError(
            str(path),
            topics.PAINT.name,
            "has impossible marks",
            f"give a recording of strokes within {FARTHEST_M:g} m, at most {WIDEST_M:g} m wide",
        )
    return marks


def joined(batches: Sequence[PaintMarks]) -> list[PaintMarks]:
    """Join batches that continue where the one before ended."""
    runs: list[list[PaintMarks]] = []
    for batch in batches:
        last = runs[-1][-1] if runs else None
        goes_on = last is not None and batch.first_index == last.first_index + len(last.x_m) - 1
        if last is not None and goes_on and batch.segment_id == last.segment_id:
            runs[-1].append(batch)
        else:
            runs.append([batch])
    return [_join(run) for run in runs]


def _join(run: list[PaintMarks]) -> PaintMarks:
    x = np.concatenate([run[0].x_m, *(batch.x_m[1:] for batch in run[1:])])
    y = np.concatenate([run[0].y_m, *(batch.y_m[1:] for batch in run[1:])])
    return run[0].model_copy(update={"x_m": x, "y_m": y})
