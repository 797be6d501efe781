"""Ends of painted segments as rows for the kernels of transition_times.py."""

from collections.abc import Sequence

import numpy as np

from touchline.core.plain_sum import plain_sum
from touchline.services.planner.geometry.clothoid import Floats, PathPose, Piece, PiecePath
from touchline.services.planner.steering.ccd import ContinuousDubins
from touchline.services.planner.steering.circles import LIMIT, circle
from touchline.services.planner.steering.method import CurveEnd, before
from touchline.services.planner.transitions.transition_times import HEADING, TurnRows, X, Y
from touchline.services.planner.transitions.transitions import TransitionFamily, Turns, from_goal

ORIGIN = PathPose(0.0, 0.0, 0.0)


def transition_rows(ends: Sequence[CurveEnd], begins: Sequence[CurveEnd], transitions: TransitionFamily) -> TurnRows:
    """Lay out ends and beginnings for all turns on offer."""
    circles = [circle(t.curvature_1pm / t.sharpness_1pm2**0.5) for t in transitions.turns]
    roots = np.array([t.sharpness_1pm2**0.5 for t in transitions.turns])
    starts = np.array(
        [_rows(ends, transitions, *each, leaving=True) for each in zip(transitions.turns, circles, strict=True)]
    )
    goals = np.array(
        [_rows(begins, transitions, *each, leaving=False) for each in zip(transitions.turns, circles, strict=True)]
    )
    return TurnRows(starts, goals, np.array(circles), roots)


def _rows(
    ends: Sequence[CurveEnd], transitions: TransitionFamily, turns: Turns, figures: Floats, *, leaving: bool
) -> Floats:
    """Rows for ends (or beginnings) with one kind of turn."""
    known: dict[tuple[float, float], tuple[float, ...]] = {}
    for end in ends:
        if end[1:] not in known:
            known[end[1:]] = _lead_row(end, transitions, turns, figures, leaving=leaving)
    rows = np.array([known[end[1:]] for end in ends])
    poses = np.array([end.pose for end in ends])
    moved = (rows[:, X] + 1j * rows[:, Y]) * np.exp(1j * poses[:, 2])
    rows[:, X], rows[:, Y] = poses[:, 0] + moved.real, poses[:, 1] + moved.imag
    rows[:, HEADING] += poses[:, 2]
    return rows


def _lead_row(
    end: CurveEnd, transitions: TransitionFamily, turns: Turns, figures: Floats, *, leaving: bool
) -> tuple[float, ...]:
    """Row for an end like this at the origin."""
    lead = transitions.lead(turns, end)
    if abs(lead.curvature_1pm) > figures[LIMIT] * turns.sharpness_1pm2**0.5:
        # The curve is tighter than these turns: they begin where the path is straight.
        words = ContinuousDubins(turns.curvature_1pm, turns.sharpness_1pm2)
        lead = lead._replace(pieces=words.lead_out(lead.curvature_1pm), curvature_1pm=0.0)
    pose = PiecePath(ORIGIN, lead.pieces).end if leaving else before(ORIGIN, from_goal(lead).pieces)
    bend: Piece | None = next((p for p in lead.pieces if p.sharpness_1pm2), None)
    straight = plain_sum(p.length_m for p in lead.pieces if not p.sharpness_1pm2)
    painted, sharpness = (bend.curvature_1pm, abs(bend.sharpness_1pm2)) if bend else (0.0, 1.0)
    return *pose, lead.curvature_1pm, transitions.speed_mps(end), painted, sharpness, straight
