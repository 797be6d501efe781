"""Rows 1 to 7: templates, smoothness, transitions between curves, and limits of the wheels."""

from collections.abc import Callable, Mapping

import numpy as np

from touchline.schemas.errors import PlanningError
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.geometry.clothoid import Floats
from touchline.services.planner.plan import Plan
from touchline.services.planner.plots.actuator_series import actuator_series
from touchline.services.planner.swaths.offset import strokes
from touchline_research.driven_template import (
    CONTESTANTS,
    STEP_1PM,
    STUDY_CCD,
    STUDY_KAPPA_1PM,
    Contestant,
    drive,
)
from touchline_research.pairs import joints, tally
from touchline_research.pitch import STUDY_SIGMA_1PM2, Pitch
from touchline_research.sent import as_biarcs, as_chords
from touchline_research.sent import joints as joints_of
from touchline_research.table import Row, of_each

GAP_M, KINK_RAD = 1e-9, 1e-9
ARC_CURVATURES_1PM = (0.0, 0.6, -0.6)
SAMPLE_M = 1e-3


def template_row(templates: Mapping[str, Template], step: Callable[[float], None] = lambda fraction: None) -> Row:
    """Row 1: plan every template with every planner."""
    managed = dict.fromkeys((c.name for c in CONTESTANTS), 0)
    failed: list[str] = []
    for done, (name, template) in enumerate(templates.items()):
        for contestant in CONTESTANTS:
            if _managed(template, contestant):
                managed[contestant.name] += 1
            else:
                failed.append(f"{contestant.name} on {name}")
        step((done + 1) / len(templates))
    total = len(templates)
    ours = managed[CONTESTANTS[-1].name]
    return Row(
        "1",
        "any 2D template of lines and arcs",
        of_each(f"{managed[c.name]} of {total}" for c in CONTESTANTS),
        "all, and points, circles, text and filled areas",
        ours == total,
        {"templates": total, **managed},
        f"templates: {', '.join(templates)}" + (f"; failed: {', '.join(failed)}" if failed else ""),
    )


def _managed(template: Template, contestant: Contestant) -> bool:
    try:
        drive(strokes(template.segments, Vehicle(), STUDY_KAPPA_1PM), contestant, STUDY_SIGMA_1PM2, STUDY_KAPPA_1PM)
    except PlanningError:
        return False
    return True


def smoothness_rows(pitch: Pitch, planned: Plan) -> list[Row]:
    """Rows 2, 3 and 5 on the whole pitch; `planned` is ours, ordered and timed."""
    gaps = [_sent_gaps(pitch, contestant) for contestant in CONTESTANTS]
    transitions = [pitch.drive(contestant).continuous_transitions() for contestant in CONTESTANTS]
    total = len(pitch.strokes) - 1
    steps = _steps(planned)
    report, ids = planned.report, [segment.id for segment in planned.trajectory.path.segments]
    painted = [segment.id for segment in pitch.template.segments if ids.count(segment.id) == 1]
    smooth = report.position_gap_m <= GAP_M and report.heading_gap_rad <= KINK_RAD
    return [
        Row(
            "2",
            "C¹: largest gap and kink of what is sent",
            of_each(f"{gap:.0e} m, {kink:.0e} rad" for gap, kink in gaps),
            "100 %, joints within 1e-9 m",
            smooth and max(gaps[-1]) <= GAP_M,
            {
                "study_ccd_kink_rad": gaps[1][1],
                "ours_gap_m": max(report.position_gap_m, gaps[-1][0]),
                "ours_kink_rad": max(report.heading_gap_rad, gaps[-1][1]),
            },
            "the study counts a joint within 1 mm as C¹; its chords (2 mm here) turn at every joint all the same. "
            "Ours is also the ordered, timed plan, from its message.",
        ),
        Row(
            "3",
            "G²: transitions, and those that join their arcs so",
            of_each(f"{within} and {joined} of {total}" for within, joined in transitions),
            "100 % of the whole trajectory",
            transitions[-1] == (total, total) and steps <= STEP_1PM,
            {
                "transitions": total,
                "study_ccd_joined": transitions[1][1],
                "ours_joined": transitions[-1][1],
                "ours_largest_step_1pm": steps,
            },
            "on the ideal curve; the largest step of curvature of ours, ordered, run-in and run-out included: "
            f"{steps:.0e} 1/m.",
        ),
        Row(
            "5",
            "full trajectory for a template",
            ("yes", "yes", f"yes, {len(painted)} of {len(pitch.strokes)} lines in {len(ids)} segments"),
            "yes",
            len(painted) == len(pitch.strokes) and smooth,
            {"painted": len(painted), "segments_sent": len(ids)},
        ),
    ]


def joint_row(count: int) -> Row:
    """Row 4: random transitions between lines and arcs to either side, `count` of each of the nine kinds."""
    total, limits = count * len(ARC_CURVATURES_1PM) ** 2, (STUDY_KAPPA_1PM, STUDY_SIGMA_1PM2)
    found = [tally(c.method(*limits), joints(count, ARC_CURVATURES_1PM), total, *limits) for c in CONTESTANTS]
    return Row(
        "4",
        "transitions between lines and arcs, G² with both",
        of_each(f"{each.continuous} of {total}" for each in found),
        "all",
        found[-1].continuous == found[-1].feasible == total,
        {"tried": total, "study_ccd": found[1].continuous, "ours": found[-1].continuous},
        "line to line, line to arc, arc to line, arc to arc, left and right, radius 1.67 m.",
    )


def limit_row(pitch: Pitch, planned: Plan) -> Row:
    """Rows 6 and 7: wheel speed and acceleration, every millimetre of ours; steps of curvature of the others."""
    steps = [int(np.count_nonzero(pitch.drive(c).steps_1pm > STEP_1PM)) for c in CONTESTANTS]
    series = actuator_series(planned, SAMPLE_M)
    broken = series.violations(pitch.vehicle)
    fastest, hardest = (float(np.abs(a).max()) for a in (series.value, series.rate))
    return Row(
        "6, 7",
        "κ and dκ/ds from the dynamics",
        (
            f"{steps[0]} steps of κ",
            f"{steps[1]} steps of κ",
            f"{broken} of {len(series.time_s):,} points beyond the wheels",
        ),
        "per point, from wheel speed and acceleration",
        broken == 0 and steps[-1] == 0,
        {
            "dpp_steps": steps[0],
            "study_ccd_steps": steps[1],
            "ours_violations": broken,
            "ours_samples": len(series.time_s),
            "ours_wheel_radps": fastest,
            "ours_wheel_radps2": hardest,
        },
        "a step of κ needs wheels that accelerate without limit. "
        f"Ours peaks at {fastest:.2f} rad/s and {hardest:.3f} rad/s² of 20 and 40, sampled every millimetre, ordered.",
    )


def _steps(planned: Plan) -> float:
    pieces = np.array([piece[:3] for section in planned.sections for piece in section.path.pieces if piece.length_m])
    return float(np.abs(pieces[1:, 1] - (pieces[:, 1] + pieces[:, 2] * pieces[:, 0])[:-1]).max())


def _sent_gaps(pitch: Pitch, contestant: Contestant) -> tuple[float, float]:
    cut = as_chords if contestant is STUDY_CCD else as_biarcs
    rows: Floats = np.concatenate([cut(path) for path in pitch.drive(contestant).paths])
    gap, kink, _ = joints_of(rows)
    return float(gap.max()), float(kink.max())
