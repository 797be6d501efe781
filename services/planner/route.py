"""The route: run-in, painted segments in order with the transitions between them, run-out."""

from collections.abc import Callable
from dataclasses import dataclass

from services.planner.clothoid import Piece, PiecePath, Pose
from services.planner.limits import Limits
from services.planner.method import TransitionMethod, before, transition
from services.planner.offset import Stroke

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


def route(
    strokes: list[Stroke], method: TransitionMethod, limits: Limits, start: Pose | None, step: Callable[[float], None]
) -> list[Section]:
    """The sections in driving order; each begins at the pose at which the last one ended.

    Without a `start` pose the robot is expected `RUN_IN_M` straight before the first line (and its lead-in).
    `step` is told the fraction done.
    """
    sections = [_run_in(strokes[0], method, limits, start)]
    for i, stroke in enumerate(strokes):
        if i:
            sections.append(Section(TRANSITION, transition(method, strokes[i - 1].end, stroke.begin)))
        sections.append(Section(stroke.label, stroke.path, stroke))
        step((i + 1) / len(strokes))
    sections.append(_run_out(strokes[-1], method, limits))
    return [section for section in sections if section.path.pieces]


def _run_in(first: Stroke, method: TransitionMethod, limits: Limits, start: Pose | None) -> Section:
    begin = first.begin
    lead_in = method.lead_in(begin.curvature_1pm)
    if start is None:
        pieces = (Piece(RUN_IN_M), *lead_in)
        return Section(RUN_IN, PiecePath(before(begin.pose, pieces), pieces))
    run_up = limits.stopping_distance_m(limits.paint_speed_mps) + STEADY_S * limits.paint_speed_mps
    path = PiecePath(start, (*method.connect(start, before(begin.pose, lead_in)), *lead_in))
    if path.length_m < run_up:
        lead_in = (Piece(run_up), *lead_in)
        path = PiecePath(start, (*method.connect(start, before(begin.pose, lead_in)), *lead_in))
    return Section(RUN_IN, path)


def _run_out(last: Stroke, method: TransitionMethod, limits: Limits) -> Section:
    end = last.end
    straight = Piece(limits.stopping_distance_m(limits.paint_speed_mps) + RUN_OUT_SPARE_M)
    return Section(RUN_OUT, PiecePath(end.pose, (*method.lead_out(end.curvature_1pm), straight)))
