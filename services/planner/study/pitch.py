"""Rows 11 to 13: how long and how far, on one field, in one order, under one set of limits."""

from collections.abc import Callable
from dataclasses import dataclass, field

from schemas.messages import PlanOptions
from schemas.template import Template
from schemas.vehicle import Vehicle
from services.planner.offset import Stroke, strokes
from services.planner.plan import Plan, plan
from services.planner.study.drive import (
    DPP,
    OURS,
    STUDY_CCD,
    STUDY_KAPPA_1PM,
    STUDY_SPEED_MPS,
    UNPADDED,
    Contestant,
    Drive,
    drive,
    study_vehicle,
)
from services.planner.study.table import Row

STUDY_SIGMA_1PM2 = 1.0
IDEAL_SIGMA_1PM2 = 3.0
# (σ_max 1/m², most that ours may be longer than DPP without padding); the last is the σ of the dynamics at 1.5 m/s.
LENGTH_TARGETS = ((1.0, 0.05), (2.1, 0.03), (7.0, 0.015))
CAPPED, WHEELS = "everything at most 1.5 m/s", "transit up to the wheels"
TIME_TARGETS = {"a": 0.0, "b": 0.05, "c": 0.35}


@dataclass
class Pitch:
    """A field, driven by everyone in the order of its template; measured from the first painted line to the last."""

    template: Template
    vehicle: Vehicle = field(default_factory=study_vehicle)
    _drives: dict[tuple[str, float], Drive] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.strokes: list[Stroke] = strokes(self.template.segments, self.vehicle, STUDY_KAPPA_1PM)

    def drive(self, contestant: Contestant, sigma_1pm2: float = STUDY_SIGMA_1PM2) -> Drive:
        """The field as the contestant drives it within κ_max = 1.125 1/m."""
        key = contestant.name, sigma_1pm2
        if key not in self._drives:
            self._drives[key] = drive(self.strokes, contestant, sigma_1pm2, STUDY_KAPPA_1PM)
        return self._drives[key]

    def longer(self, contestant: Contestant, sigma_1pm2: float, than: Contestant = UNPADDED) -> float:
        """By which share the contestant drives farther than another."""
        return self.drive(contestant, sigma_1pm2).length_m / self.drive(than).length_m - 1.0

    def plan(self, **options: str | float | bool) -> Plan:
        """Ours, timed under nothing but the wheels' limits; paints at 1.5 m/s as the study does."""
        return plan(
            self.template, self.vehicle, PlanOptions(paint_speed_mps=STUDY_SPEED_MPS, forward_only=True, **options)
        )


def painting_seconds(planned: Plan) -> float:
    """From the start of the first painted line to the end of the last."""
    first, last = planned.painted[0], planned.painted[-1]
    return planned.speeds.time_at(last.end_m) - planned.speeds.time_at(first.start_m)


def duration_rows(pitch: Pitch, step: Callable[[float], None] = lambda fraction: None) -> list[Row]:
    """Rows 11a to 11c, and 13: the same with σ_max = 3.0."""
    wheels = pitch.vehicle.max_rim_speed_mps
    asked: dict[str, tuple[str, dict[str, str | float | bool]]] = {
        "a": (f"total time, {CAPPED}", {"order": "given", "transit_speed_mps": STUDY_SPEED_MPS}),
        "b": (f"total time, {WHEELS}", {"order": "given", "transit_speed_mps": wheels}),
        "c": (f"total time, {WHEELS}, ordered", {"order": "optimised", "transit_speed_mps": wheels}),
    }
    base = pitch.drive(DPP).seconds(STUDY_SPEED_MPS)
    theirs = pitch.drive(STUDY_CCD).seconds(STUDY_SPEED_MPS)
    same_turns = painting_seconds(
        pitch.plan(kappa_max_1pm=STUDY_KAPPA_1PM, sigma_max_1pm2=IDEAL_SIGMA_1PM2, **asked["a"][1])
    )
    rows, gentle, sharpest = [], {}, 0.0
    for done, (letter, (requirement, options)) in enumerate(asked.items()):
        seconds = painting_seconds(pitch.plan(**options))
        step((2 * done + 1) / 6)
        softly = pitch.plan(sigma_max_1pm2=IDEAL_SIGMA_1PM2, **options)
        step((2 * done + 2) / 6)
        gentle[letter], sharpest = painting_seconds(softly), max(sharpest, softly.report.max_sharpness_1pm2)
        target = TIME_TARGETS[letter]
        figures = {"dpp_s": base, "study_ccd_s": theirs, "ours_s": seconds, "ours_share": seconds / base - 1.0}
        note = ""
        if letter == "a":
            figures["ours_same_kappa_sigma_3_s"] = same_turns
            note = (
                f"with the study's κ_max = 1.125 for ours too, and σ_max = 3.0: {same_turns:.1f} s "
                f"({same_turns / base - 1.0:+.2%}); else ours takes κ and σ from the wheels' limits, point by point."
            )
        rows.append(
            Row(
                f"11{letter}",
                requirement,
                (
                    f"{base:.1f} s",
                    f"{theirs:.1f} s ({theirs / base - 1.0:+.1%})",
                    f"{seconds:.1f} s ({seconds / base - 1.0:+.1%})",
                ),
                f"≥ {target:.0%} below DPP" if target else "below DPP",
                seconds < base * (1.0 - target) and (letter != "a" or same_turns < base),
                figures,
                note,
            )
        )
    rows.append(_sharpness_row(gentle, sharpest, base))
    return rows


def _sharpness_row(seconds: dict[str, float], sharpest: float, base: float) -> Row:
    shares = {letter: value / base - 1.0 for letter, value in seconds.items()}
    return Row(
        "13",
        "dκ/ds",
        ("∞ (steps)", f"{STUDY_SIGMA_1PM2:.1f} m⁻², ∞ at arcs", f"{sharpest:.2f} m⁻²"),
        "≤ 3.00 m⁻² while meeting 11",
        sharpest <= IDEAL_SIGMA_1PM2 * (1 + 1e-9) and all(shares[k] <= -TIME_TARGETS[k] for k in shares),
        {"ours_max_sharpness_1pm2": sharpest, **{f"ours_11{k}_share": v for k, v in shares.items()}},
        "11 with σ_max = 3.0: " + ", ".join(f"{k} {v:+.1%}" for k, v in shares.items()),
    )


def length_rows(pitch: Pitch) -> list[Row]:
    """Row 12 at each σ: the study's CCD and ours, longer than DPP without padding."""
    rows = []
    dpp, unpadded = pitch.drive(DPP), pitch.drive(UNPADDED)
    padding = dpp.length_m / unpadded.length_m - 1.0
    for letter, (sigma, most) in zip("abc", LENGTH_TARGETS, strict=True):
        theirs, ours = (pitch.longer(contestant, sigma) for contestant in (STUDY_CCD, OURS))
        below_padded = pitch.longer(OURS, sigma, DPP) < 0.0
        last = letter == "c"
        rows.append(
            Row(
                f"12{letter}",
                f"length at σ_max = {sigma:g}" + (" (the dynamics)" if last else ""),
                (
                    f"{unpadded.length_m:.1f} m; {padding:+.1%} padded",
                    f"{theirs:+.1%}",
                    f"{ours:+.1%}" + (f"; {pitch.longer(OURS, sigma, DPP):+.1%} against padded" if last else ""),
                ),
                f"≤ {most:+.1%}" + (" and below DPP with padding" if last else ""),
                ours <= most and (below_padded or not last),
                {"dpp_unpadded_m": unpadded.length_m, "dpp_m": dpp.length_m, "study_ccd": theirs, "ours": ours},
                ""
                if letter != "a"
                else "against plain Dubins without padding, painted lines included, κ_max = 1.125 for all.",
            )
        )
    return rows


def longer_by_sigma(pitch: Pitch, sigmas: tuple[float, ...]) -> dict[str, list[float]]:
    """For each σ: how much longer the study's CCD and ours are than DPP without padding."""
    return {c.name: [pitch.longer(c, sigma) for sigma in sigmas] for c in (STUDY_CCD, OURS)}
