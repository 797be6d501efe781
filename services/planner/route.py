"""The route: run-in, painted segments in order with the transitions between them, run-out."""

from collections.abc import Callable
from dataclasses import dataclass

from services.planner.clothoid import Piece, PiecePath, Pose
from services.planner.method import CurveEnd, before
from services.planner.offset import Stroke
from services.planner.ways import Ways

# Straight run before the first line: an estimator that starts with an unknown heading has it within a degree after 5 m.
RUN_IN_M = 5.0
# The robot comes to rest this far before the end of the run-out's straight.
RUN_OUT_SPARE_M = 0.1
# Speed is steady this long before the first line, so the valve opens at the speed it was timed for.
STEADY_S = 0.5

RUN_IN, TRANSITION, RUN_OUT = "run-in", "transition", "run-out"


@dataclass(frozen=True)
class Section:
    """A painted segment, or the way between two of them."""

    label: str
    path: PiecePath
    stroke: Stroke | None = None


def route(strokes: list[Stroke], ways: Ways, start: Pose | None, step: Callable[[float], None]) -> list[Section]:
    """The sections in driving order; each begins at the pose at which the last one ended.

    Without a `start` pose the robot is expected `RUN_IN_M` straight before the first line (and its lead-in).
    `step` is told the fraction done.
    """
    sections = [Section(RUN_IN, _run_in(strokes[0].begin, ways, start))]
    for i, stroke in enumerate(strokes):
        if i:
            sections.append(Section(TRANSITION, ways.between(strokes[i - 1].end, stroke.begin)[0].path))
        sections.append(Section(stroke.label, stroke.path, stroke))
        step((i + 1) / len(strokes))
    sections.append(Section(RUN_OUT, _run_out(strokes[-1].end, ways)))
    return [section for section in sections if section.path.pieces]


def _run_in(begin: CurveEnd, ways: Ways, start: Pose | None) -> PiecePath:
    turns = ways.widest(begin.curvature_1pm)
    if start is None:
        pieces = (Piece(RUN_IN_M), *turns.method.lead_in(begin.curvature_1pm))
        return PiecePath(before(begin.pose, pieces), pieces)
    speed = ways.speed_mps(begin.curvature_1pm)
    run_up = ways.limits.stopping_distance_m(speed) + STEADY_S * speed
    path = ways.from_rest(start, begin, 0.0).path
    return path if path.length_m >= run_up else ways.from_rest(start, begin, run_up).path


def _run_out(end: CurveEnd, ways: Ways) -> PiecePath:
    speed = ways.speed_mps(end.curvature_1pm)
    straight = Piece(ways.limits.stopping_distance_m(speed) + RUN_OUT_SPARE_M)
    return PiecePath(end.pose, (*ways.widest(end.curvature_1pm).method.lead_out(end.curvature_1pm), straight))
