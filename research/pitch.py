"""Field that all planners drive in one order and under the same limits, and row 12: length."""

from dataclasses import dataclass, field

from touchline.schemas.messages import PlanOptions
from touchline.schemas.template import Template, TemplateSegment
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.plan import Plan, plan
from touchline.services.planner.swaths.offset import Stroke, strokes
from touchline_research.driven_template import (
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
from touchline_research.table import Row

STUDY_SIGMA_1PM2 = 1.0
# (σ_max 1/m², maximum excess length of ours over DPP without padding); the last is the σ of the dynamics at 1.5 m/s.
IDEAL_SIGMA_1PM2 = 3.0
LENGTH_TARGETS = ((1.0, 0.05), (2.1, 0.03), (7.0, 0.015))
# Law 1 of the game describes the markings in this order; the shipped template has one that was optimised by hand.
HAND_ORDERED = ", by hand"
LAW_1 = (
    "touchline",
    "goal-line",
    "halfway-line",
    "centre-mark",
    "centre-circle",
    "goal-area",
    "penalty-area",
    "penalty-mark",
    "penalty-arc",
    "corner-arc",
)
# Drying time (s) that stands for none, as the study's planners ignore wet paint.
NO_DRYING_S = 1e-3


@dataclass
class Pitch:
    """Field that all planners drive in the order of its template; measured from the first painted line to the last."""

    template: Template
    vehicle: Vehicle = field(default_factory=study_vehicle)
    _drives: dict[tuple[str, float], Drive] = field(default_factory=dict)
    _plans: dict[tuple[tuple[str, str | float], ...], Plan] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.strokes: list[Stroke] = strokes(self.template.segments, self.vehicle, STUDY_KAPPA_1PM)

    def drive(self, contestant: Contestant, sigma_1pm2: float = STUDY_SIGMA_1PM2) -> Drive:
        """Drive of the contestant within κ_max = 1.125 1/m."""
        key = contestant.name, sigma_1pm2
        if key not in self._drives:
            self._drives[key] = drive(self.strokes, contestant, sigma_1pm2, STUDY_KAPPA_1PM)
        return self._drives[key]

    def longer(self, contestant: Contestant, sigma_1pm2: float, than: Contestant = UNPADDED) -> float:
        """Relative excess length of the contestant over another."""
        return self.drive(contestant, sigma_1pm2).length_m / self.drive(than).length_m - 1.0

    def plan(self, **options: str | float) -> Plan:
        """Plan of ours within the wheels' limits only; it paints at 1.5 m/s as the study does."""
        fixed = {"paint_speed_mps": STUDY_SPEED_MPS, "forward_only": True, "drying_time_s": NO_DRYING_S}
        key = tuple(sorted(options.items()))
        if key not in self._plans:
            self._plans[key] = plan(self.template, self.vehicle, PlanOptions.model_validate(fixed | options))
        return self._plans[key]

    def in_order_of_the_law(self) -> "Pitch":
        """Copy of the field with its lines in the order of Law 1."""

        def rank(segment: TemplateSegment) -> int:
            return next((i for i, name in enumerate(LAW_1) if segment.id.startswith(name)), len(LAW_1))

        segments = tuple(sorted(self.template.segments, key=rank))
        return Pitch(self.template.model_copy(update={"segments": segments}), self.vehicle)


def length_rows(pitch: Pitch, suffix: str = "") -> list[Row]:
    """Measure row 12 at each σ: excess length of the study's CCD and ours over DPP without padding.

    Args:
        pitch: Field, driven in the order of its template.
        suffix: Added to the rows' numbers.
    """
    rows = []
    dpp, unpadded = pitch.drive(DPP), pitch.drive(UNPADDED)
    padding = dpp.length_m / unpadded.length_m - 1.0
    for letter, (sigma, most) in zip("abc", LENGTH_TARGETS, strict=True):
        theirs, ours = (pitch.longer(contestant, sigma) for contestant in (STUDY_CCD, OURS))
        below_padded = pitch.longer(OURS, sigma, DPP) < 0.0
        last = letter == "c"
        rows.append(
            Row(
                f"12{letter}{suffix}",
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
                if letter != "a" or suffix
                else "against plain Dubins without padding, painted lines included, κ_max = 1.125 for all.",
            )
        )
    rows.append(_ideal_row(pitch, suffix))
    return rows


def _ideal_row(pitch: Pitch, suffix: str) -> Row:
    """Measure the study's ideals of rows 12 and 13 at once: shorter than padded DPP, with dκ/ds ≤ 3.0 m⁻²."""
    theirs, ours = (pitch.longer(contestant, IDEAL_SIGMA_1PM2, DPP) for contestant in (STUDY_CCD, OURS))
    return Row(
        f"12 and 13, ideal{suffix}",
        f"length at σ_max = {IDEAL_SIGMA_1PM2:g} against DPP with padding",
        (f"{pitch.drive(DPP).length_m:.1f} m", f"{theirs:+.2%}", f"{ours:+.2%}"),
        "below DPP with padding",
        ours < 0.0,
        {"dpp_m": pitch.drive(DPP).length_m, "study_ccd": theirs, "ours": ours},
    )


def longer_by_sigma(pitch: Pitch, sigmas: tuple[float, ...]) -> dict[str, list[float]]:
    """Excess lengths of the study's CCD and ours over DPP without padding, for each σ."""
    return {c.name: [pitch.longer(c, sigma) for sigma in sigmas] for c in (STUDY_CCD, OURS)}
