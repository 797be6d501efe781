"""Row 11 like for like: DPP and ours in one order, at one speed, within the same limits; and the gain by its causes.

DPP gets all that ours has: order, speeds, the wheels' speed and acceleration along the path, and the choice, by time,
among the same turns. Only its steps of curvature, which would take unlimited acceleration of the wheels, are forgiven.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from math import isfinite
from typing import NamedTuple

import numpy as np

from touchline.schemas.curves import Curve
from touchline.schemas.messages import PlanOptions
from touchline.schemas.template import ArcSpec, LineSpec, TemplateSegment
from touchline.services.planner.geometry.clothoid import Piece, PiecePath, joined
from touchline.services.planner.limits import Limits
from touchline.services.planner.plan import Plan
from touchline.services.planner.steering.dubins_padded import PADDING_AFTER_M, PADDING_BEFORE_M, PaddedDubins
from touchline.services.planner.steering.g2 import Steering
from touchline.services.planner.steering.method import CurveEnd, before, extension
from touchline.services.planner.swaths.offset import strokes
from touchline.services.planner.transitions.transitions import BRAKING_SHARE, Transition, TransitionFamily
from touchline_research.bound import turning_bound_s
from touchline_research.driven_template import DPP, STEP_1PM, STUDY_KAPPA_1PM, STUDY_SPEED_MPS, Drive
from touchline_research.durations import painting_seconds
from touchline_research.pitch import Pitch
from touchline_research.table import Cause, Row

LAW, HAND, OURS = "Law 1", "by hand", "ours"
WHEELS = 0.0
LIMIT_SLACK = 1e-6


class Setting(NamedTuple):
    """Common setting of both planners: name of the order, maximum transit speed, κ_max (0: what the wheels allow)."""

    order: str
    transit_speed_mps: float
    kappa_max_1pm: float

    def __str__(self) -> str:
        speed = "1.5 m/s" if self.transit_speed_mps == STUDY_SPEED_MPS else "up to the wheels' speed"
        kappa = f"κ ≤ {self.kappa_max_1pm:g}" if self.kappa_max_1pm else "κ as the wheels allow"
        return f"{_ORDERS.get(self.order, self.order)}, {speed}, {kappa}"


_ORDERS = {LAW: "order of Law 1", HAND: "order by hand", OURS: "our order"}


class Padding(NamedTuple):
    """Straight pieces before and after each painted line, m."""

    before_m: float
    after_m: float


DPP_PADDING = Padding(PADDING_BEFORE_M, PADDING_AFTER_M)
NO_PADDING = Padding(0.0, 0.0)


class Match(NamedTuple):
    """Result of both planners in one setting: seconds, DPP's steps of curvature, whether ours has none and is feasible.

    Attributes:
        unpadded_s: DPP without its padding, for information: a robot needs it to settle before a line.
    """

    setting: Setting
    dpp_s: float
    unpadded_s: float
    dpp_steps: int
    ours_s: float
    ours_kept: bool

    @property
    def met(self) -> bool:
        """True if ours takes less time without steps of curvature and within the wheels' limits."""
        return self.ours_kept and self.ours_s < self.dpp_s


def matches(
    pitches: Mapping[str, Pitch], step: Callable[[float], None] = lambda fraction: None
) -> dict[Setting, Match]:
    """Measure every setting of the table: each order, both speeds, both limits of curvature.

    Args:
        pitches: Field by the name of the order of its lines.
        step: Called with the fraction done.
    """
    found: dict[Setting, Match] = {}
    for name, pitch in pitches.items():
        for speed in (STUDY_SPEED_MPS, pitch.vehicle.drive.max_speed_mps):
            for kappa in (STUDY_KAPPA_1PM, WHEELS):
                setting = Setting(name, speed, kappa)
                found[setting] = match(pitch, setting)
                step(len(found) / (4 * len(pitches)))
    return found


def match(pitch: Pitch, setting: Setting) -> Match:
    """Measure DPP and ours on a field in the order of its lines."""
    options = {"transit_speed_mps": setting.transit_speed_mps, "kappa_max_1pm": setting.kappa_max_1pm}
    ours = pitch.plan(order="given", **options)
    limits = Limits.of(pitch.vehicle, PlanOptions(paint_speed_mps=STUDY_SPEED_MPS, **options))
    seconds, driven = dubins_padded(pitch, limits)
    unpadded_s, _ = dubins_padded(pitch, limits, NO_PADDING)
    steps = int(np.count_nonzero(driven.steps_1pm > STEP_1PM))
    return Match(setting, seconds, unpadded_s, steps, painting_seconds(ours), _kept(pitch, ours))


def dubins_padded(pitch: Pitch, limits: Limits, padding: Padding = DPP_PADDING) -> tuple[float, Drive]:
    """Drive of DPP within the limits, with its seconds from the first painted line to the end of the last."""
    transitions = TransitionFamily.by_time(Steering, limits)
    lines = strokes(pitch.template.segments, pitch.vehicle, limits.curvature_max_1pm)
    found = [_padded_transition(transitions, a.end, b.begin, padding) for a, b in pairwise(lines)]
    painting = sum(line.path.length_m / transitions.speed_mps(line.begin) for line in lines)
    return painting + sum(transition.seconds for transition in found), Drive(
        lines, [transition.path for transition in found]
    )


def _padded_transition(transitions: TransitionFamily, start: CurveEnd, goal: CurveEnd, padding: Padding) -> Transition:
    """Quickest of the padded Dubins paths with the turns on offer; before slow ones there is room to brake."""
    speeds = transitions.speed_mps(start), transitions.speed_mps(goal)
    gain = 2.0 * BRAKING_SHARE * transitions.limits.acceleration_mps2
    into = (Piece(padding.before_m),)
    offers = []
    for turns in transitions.turns:
        out = (Piece(max(padding.after_m, (speeds[0] ** 2 - turns.speed_mps**2) / gain)),)
        leaving, reaching = PiecePath(start.pose, out).end, before(goal.pose, into)
        between = PaddedDubins(turns.curvature_1pm).connect(leaving, reaching)
        path = PiecePath(start.pose, joined((*out, *between, *into)))
        offers.append(Transition(transitions.seconds(path.pieces, *speeds), path))
    quickest = min(offers, key=lambda transition: transition.seconds)
    straight_on = extension(start, goal, quickest.path.length_m)
    return Transition(transitions.seconds(straight_on.pieces, *speeds), straight_on) if straight_on else quickest


def _kept(pitch: Pitch, planned: Plan) -> bool:
    """True if a plan has no steps of curvature and both wheels keep their limits."""
    report, vehicle = planned.report, pitch.vehicle
    most = 1.0 + LIMIT_SLACK
    return isfinite(report.max_sharpness_1pm2) and all(
        asked.max <= wheel.limit * most and asked.max_rate <= wheel.rate_limit * most
        for asked, wheel in zip(report.actuators, vehicle.drive.actuators, strict=True)
    )


def in_order_of(pitch: Pitch, planned: Plan) -> Pitch:
    """Copy of a field with its lines in the order and directions of a plan."""
    given = {segment.id: segment for segment in pitch.template.segments}
    painted = [s.stroke for s in planned.sections if s.stroke]
    segments = tuple(_directed(given[stroke.id], stroke.nozzle) for stroke in painted)
    return Pitch(pitch.template.model_copy(update={"segments": segments}), pitch.vehicle)


def _directed(segment: TemplateSegment, curve: Curve) -> TemplateSegment:
    start, end = (curve.x_m, curve.y_m), curve.end[:2]
    if segment.arc is None:
        return segment.model_copy(update={"line": LineSpec(start=start, end=end)})
    arc = ArcSpec(start=start, center=segment.arc.center, sweep_angle=curve.curvature_1pm * curve.length_m)
    return segment.model_copy(update={"arc": arc})


def match_rows(found: Mapping[Setting, Match]) -> list[Row]:
    """Rows of all settings; the target is that ours is below DPP."""
    first, *others = (_match_row(f"11.{number}", each) for number, each in enumerate(found.values(), 1))
    return [replace(first, note=_UNPADDED_NOTE), *others]


_UNPADDED_NOTE = (
    "the gain is the padding that DPP needs, 0.5 m before and 0.1 m after each line: with κ ≤ 1.125 ours takes longer "
    "than plain Dubins paths without it. Where tighter, slower turns are on offer, those lack the straight on which to "
    "gather speed before a line, so that theirs is no lower bound."
)


def _match_row(number: str, each: Match) -> Row:
    share, unpadded = each.ours_s / each.dpp_s - 1.0, each.ours_s / each.unpadded_s - 1.0
    kept = "none" if each.ours_kept else "beyond the limits"
    return Row(
        number,
        f"total time, like for like: {each.setting}",
        (
            f"{each.dpp_s:.1f} s, {each.dpp_steps} steps of κ",
            "–",
            f"{each.ours_s:.1f} s ({share:+.2%}; {unpadded:+.2%} against DPP unpadded), {kept}",
        ),
        "below DPP, without a step of κ, within the wheels' limits",
        each.met,
        {
            "dpp_s": each.dpp_s,
            "dpp_steps": each.dpp_steps,
            "ours_s": each.ours_s,
            "ours_share": share,
            "ours_share_unpadded": unpadded,
            "ours_kept": each.ours_kept,
        },
    )


def causes(found: Mapping[Setting, Match]) -> list[Cause]:
    """Gains by cause, exchanged one after the other, from DPP as the study drives it to ours."""
    fastest = max(setting.transit_speed_mps for setting in found)
    stages: Sequence[tuple[str, float]] = (
        ("", found[Setting(LAW, STUDY_SPEED_MPS, STUDY_KAPPA_1PM)].dpp_s),
        ("order: Law 1's for ours", found[Setting(OURS, STUDY_SPEED_MPS, STUDY_KAPPA_1PM)].dpp_s),
        ("speed: 1.5 m/s for the wheels'", found[Setting(OURS, fastest, STUDY_KAPPA_1PM)].dpp_s),
        ("curvature: κ ≤ 1.125 for what the wheels allow", found[Setting(OURS, fastest, WHEELS)].dpp_s),
        ("transitions: DPP's for ours", found[Setting(OURS, fastest, WHEELS)].ours_s),
    )
    first = stages[0][1]
    return [Cause(name, earlier, seconds, first) for (_, earlier), (name, seconds) in pairwise(stages)]


def too_fast_row(pitch: Pitch, found: Mapping[Setting, Match]) -> Row:
    """Row for information: DPP at the wheels' speed in its turns, too, which is beyond the limit of its outer wheel.

    Args:
        pitch: Field in the order of Law 1.
        found: Results of `matches`.
    """
    fastest, most_radps = pitch.vehicle.drive.max_speed_mps, pitch.vehicle.drive.max_wheel_speed_radps
    driven = pitch.drive(DPP)
    dpp = driven.painted_m / STUDY_SPEED_MPS + driven.transition_m / fastest
    outer_radps = most_radps * (1.0 + STUDY_KAPPA_1PM * pitch.vehicle.drive.half_track_m)
    ours, free = (found[Setting(LAW, fastest, kappa)].ours_s for kappa in (STUDY_KAPPA_1PM, WHEELS))
    bound = turning_bound_s(pitch)
    return Row(
        "11, too fast",
        f"total time, DPP at {fastest:g} m/s in its turns, too: order of Law 1, κ ≤ {STUDY_KAPPA_1PM:g}",
        (f"{dpp:.1f} s, wheel at {outer_radps:.1f} rad/s", "–", f"{ours:.1f} s ({ours / dpp - 1.0:+.2%})"),
        "",
        None,
        {"dpp_s": dpp, "ours_s": ours, "bound_s": bound, "dpp_wheel_radps": outer_radps},
        f"not met and not claimed: DPP's outer wheel would turn at {outer_radps:.1f} rad/s of {most_radps:g}. What "
        f"keeps κ_max and the wheels' speed takes {bound:.1f} s at least ({bound / dpp - 1.0:+.2%}): no path is "
        "shorter than plain Dubins without padding or turns by less than the headings differ, and with the outer rim "
        "at v_w a path of length L that turns by θ takes (L + r·θ)/v_w. That bound leaves out clothoids, the wheels' "
        f"acceleration and the detour of a turn of 270°. With κ as the wheels allow ours takes {free:.1f} s "
        f"({free / dpp - 1.0:+.2%}).",
    )
