"""What was painted in a recorded session."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from touchline.schemas import topics
from touchline.schemas.catalogue import parse_template
from touchline.schemas.cdr import decode
from touchline.schemas.errors import SpecError
from touchline.schemas.messages import PaintMarks, String, TraversalReport
from touchline.schemas.template import MAX_COORDINATE_M, Template

#: Points of strokes that are drawn: a day of painting.
MOST_POINTS = 10_000_000
FARTHEST_M = 2 * MAX_COORDINATE_M
WIDEST_M = 10.0


@dataclass(frozen=True)
class RecordedPaint:
    """A traversal's paint; ``report`` is missing from a recording that ends before it."""

    template: Template
    strokes: list[PaintMarks]
    report: TraversalReport | None


def read_painted(path: Path) -> RecordedPaint:
    """The last traversal of the recording at ``path``, batches of marks joined to strokes again.

    Raises:
        RecordingError: The file cannot be read.
        SpecError: No template is recorded in it, or its paint is nowhere or too much to be drawn.
        PayloadError: A message in it is none of its topic.
    """
    from touchline.services.bridge.channels import topic_at
    from touchline.services.bridge.decoding import as_message
    from touchline.services.bridge.reader import RecordingReader

    template_json, batches, report = "", list[PaintMarks](), None
    reader, points = RecordingReader(path), 0
    for message in reader.messages():
        topic = topic_at(message.topic)
        if topic is topics.TEMPLATE:
            template_json, batches, report = decode(String, message.payload).data, [], None
        elif topic is topics.PAINT:
            batches.append(_checked(decode(PaintMarks, message.payload), path))
            points += len(batches[-1].x_m) + 1
            if points > MOST_POINTS:
                raise SpecError(str(path), topic.name, f"has more than {MOST_POINTS:,} points", "draw a shorter one")
        elif topic is topics.REPORT:
            report = as_message(TraversalReport, message)
    if not template_json:
        found = f"holds no template{f', and is {reader.summary.problem}' if reader.summary.problem else ''}"
        raise SpecError(str(path), "", found, "give the recording of a template's traversal")
    return RecordedPaint(
        parse_template(template_json, f"the template in {path.name}", recorded=True), _joined(batches), report
    )


def _checked(marks: PaintMarks, path: Path) -> PaintMarks:
    """``marks``, if they can be drawn."""
    drawable = (
        len(marks.x_m) == len(marks.y_m)
        and all(bool((np.abs(axis) <= FARTHEST_M).all()) for axis in (marks.x_m, marks.y_m))
        and 0.0 <= marks.width_m <= WIDEST_M
    )
    if not drawable:
        raise SpecError(
            str(path),
            topics.PAINT.name,
            "has marks that no robot made",
            f"give a recording of strokes within {FARTHEST_M:g} m, at most {WIDEST_M:g} m wide",
        )
    return marks


def _joined(batches: list[PaintMarks]) -> list[PaintMarks]:
    """Batches that go on where the one before ended, as one."""
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
