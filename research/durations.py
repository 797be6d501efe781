"""Rows 11a to 11c and 13: duration of ours against DPP as the study drives it, also with dκ/ds ≤ 3.00.

DPP and the study's CCD drive at 1.5 m/s throughout, as in the study, though no wheel could follow their steps. Ours
paints at 1.5 m/s and is timed under the wheels' limits. Run-in and run-out are left out for all. This mixes order,
speed and transitions: like_for_like.py takes them apart.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

from touchline.services.planner.plan import Plan
from touchline_research.bound import straight_hops_s
from touchline_research.driven_template import DPP, STUDY_CCD, STUDY_SPEED_MPS
from touchline_research.pitch import HAND_ORDERED, IDEAL_SIGMA_1PM2, STUDY_SIGMA_1PM2, Pitch
from touchline_research.table import Row

# Duration (s) of the study's DPP on its own pitch.
STUDY_DPP_S = 18 * 60 + 41

_TOTAL_NOTE = (
    "the targets of 11a to 11c are against DPP as the study drives it, at 1.5 m/s in the given order. That is not like "
    "for like: 11.1 to 11.12 are, and the causes tell what each difference is worth."
)

Options = dict[str, str | float]


class Case(NamedTuple):
    """Target of row 11: letter, requirement, minimum gain on DPP, and the order and speed of ours."""

    letter: str
    requirement: str
    below: float
    order: str
    transit_speed_mps: float

    @property
    def options(self) -> Options:
        """Options of our plan."""
        return {"order": self.order, "transit_speed_mps": self.transit_speed_mps}

    @property
    def must(self) -> str:
        """Target as text."""
        return f"≥ {self.below:.0%} below DPP" if self.below else "below DPP"


def cases(pitch: Pitch) -> tuple[Case, ...]:
    """List the targets of row 11."""
    wheels = pitch.vehicle.drive.max_speed_mps
    return (
        Case("a", "total time, ours at most 1.5 m/s", 0.0, "given", STUDY_SPEED_MPS),
        Case("b", "total time, ours in transit up to the wheels", 0.05, "given", wheels),
        Case("c", "total time, ours in transit up to the wheels, ordered", 0.35, "optimised", wheels),
    )


def painting_seconds(planned: Plan) -> float:
    """Seconds from the start of the first painted line to the end of the last."""
    first, last = planned.painted[0], planned.painted[-1]
    return planned.speeds.time_at(last.end_m) - planned.speeds.time_at(first.start_m)


def duration_rows(pitch: Pitch, step: Callable[[float], None] = lambda fraction: None) -> list[Row]:
    """Measure rows 11a to 11c, and 13."""
    rows = []
    gentle: list[tuple[Case, float]] = []
    sharpest = 0.0
    dpp = pitch.drive(DPP).seconds(STUDY_SPEED_MPS)
    asked = cases(pitch)
    for done, case in enumerate(asked):
        rows.append(_row(pitch, case, f"11{case.letter}"))
        softly = pitch.plan(sigma_max_1pm2=IDEAL_SIGMA_1PM2, **case.options)
        gentle.append((case, painting_seconds(softly) / dpp - 1.0))
        sharpest = max(sharpest, softly.report.max_sharpness_1pm2)
        step((done + 1) / (len(asked) + 1))
    rows[0] = replace(rows[0], note=_TOTAL_NOTE)
    rows[-1] = replace(rows[-1], note=_order_note(rows[-1]))
    return [*rows, _sharpness_row(gentle, sharpest)]


def hand_ordered_rows(pitch: Pitch) -> list[Row]:
    """Measure row 11 for a template that was ordered by hand, where no planner can reach 11c."""
    dpp = pitch.drive(DPP).seconds(STUDY_SPEED_MPS)
    bound = straight_hops_s(pitch)
    *same, ordered = cases(pitch)
    wheels = pitch.vehicle.drive.max_speed_mps
    rows = [_row(pitch, case, f"11{case.letter}{HAND_ORDERED}") for case in same]
    note = (
        f"for information: straight hops from line to line at {wheels:g} m/s, without turning "
        f"or gathering speed, take {bound:.1f} s in the best order found ({bound / dpp - 1.0:+.1%}): against an order "
        f"that was optimised by hand already, nothing that turns on wheels comes {ordered.below:.0%} below."
    )
    last = _row(pitch, ordered, f"11{ordered.letter}{HAND_ORDERED}")
    return [*rows, replace(last, must="", met=None, note=note)]


def _order_note(row: Row) -> str:
    below = float(row.figures["ours_s"] or 0.0) / STUDY_DPP_S - 1.0
    return (
        "the lines are given in the order in which Law 1 of the game describes them. The study's pitch, whose order is "
        f"not known, took its DPP {STUDY_DPP_S} s: ours is {below:+.1%} from that."
    )


def _row(pitch: Pitch, case: Case, number: str) -> Row:
    dpp, theirs = (pitch.drive(contestant).seconds(STUDY_SPEED_MPS) for contestant in (DPP, STUDY_CCD))
    ours = painting_seconds(pitch.plan(**case.options))
    figures = {"dpp_s": dpp, "study_ccd_s": theirs, "ours_s": ours, "ours_share": ours / dpp - 1.0}
    texts = (f"{dpp:.1f} s", _against(theirs, dpp), _against(ours, dpp))
    return Row(number, case.requirement, texts, case.must, ours < dpp * (1.0 - case.below), figures)


def _against(seconds: float, dpp: float) -> str:
    return f"{seconds:.1f} s ({seconds / dpp - 1.0:+.1%})"


def _sharpness_row(gentle: list[tuple[Case, float]], sharpest: float) -> Row:
    met = [share < -case.below if case.below == 0.0 else share <= -case.below for case, share in gentle]
    return Row(
        "13",
        "dκ/ds",
        ("∞ (steps)", f"{STUDY_SIGMA_1PM2:.1f} m⁻², ∞ at arcs", f"{sharpest:.2f} m⁻²"),
        "≤ 3.00 m⁻² while meeting 11",
        sharpest <= IDEAL_SIGMA_1PM2 * (1 + 1e-9) and all(met),
        {
            "ours_max_sharpness_1pm2": sharpest,
            **{f"ours_11{case.letter}_share": share for case, share in gentle},
        },
        "11 with σ_max = 3.0: " + ", ".join(f"{case.letter} {share:+.1%}" for case, share in gentle) + ".",
    )
