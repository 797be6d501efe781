"""Template driven by one of the planners: strokes, transitions, and the figures that are compared."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.geometry.clothoid import Floats, Piece, PiecePath
from touchline.services.planner.steering.dubins import dubins_pieces
from touchline.services.planner.steering.dubins_padded import PaddedDubins
from touchline.services.planner.steering.g2 import Steering
from touchline.services.planner.steering.method import CurveEnd, TransitionMethod, transition
from touchline.services.planner.swaths.offset import Stroke
from touchline_research.study_ccd import StudyContinuousDubins

STUDY_KAPPA_1PM = 1.125
STUDY_SPEED_MPS = 1.5
# Curvatures closer than this (1/m) are equal.
STEP_1PM = 1e-9


class UnpaddedDubins(PaddedDubins):
    """DPP without its padding, the reference of lengths in the study."""

    name = "dubins"

    def between(self, start: CurveEnd, goal: CurveEnd) -> tuple[Piece, ...]:
        """Optimal Dubins path."""
        return dubins_pieces(start.pose, goal.pose, self.curvature_max_1pm)


@dataclass(frozen=True)
class Contestant:
    """Compared planner: its name in the table and its transitions for a κ_max (1/m) and σ_max (1/m²)."""

    name: str
    method: Callable[[float, float], TransitionMethod]


DPP = Contestant("DPP", lambda kappa, sigma: PaddedDubins(kappa))
STUDY_CCD = Contestant("study CCD", StudyContinuousDubins)
OURS = Contestant("ours", Steering)
CONTESTANTS = (DPP, STUDY_CCD, OURS)


@dataclass(frozen=True)
class Drive:
    """Drive from the start of the first painted segment to the end of the last: strokes and transitions.

    Run-in and run-out are left out for all planners, and with them DPP's padding before the first line and after the
    last.
    """

    strokes: Sequence[Stroke]
    transitions: Sequence[PiecePath]

    @property
    def painted_m(self) -> float:
        """Length driven while painting (m)."""
        return sum(stroke.path.length_m for stroke in self.strokes)

    @property
    def transition_m(self) -> float:
        """Length of the transitions (m)."""
        return sum(between.length_m for between in self.transitions)

    @property
    def length_m(self) -> float:
        """Total length (m)."""
        return self.painted_m + self.transition_m

    def seconds(self, speed_mps: float) -> float:
        """Duration at one speed, as in the study."""
        return self.length_m / speed_mps

    @cached_property
    def paths(self) -> list[PiecePath]:
        """Strokes and transitions in driving order."""
        paths = [self.strokes[0].path]
        for between, stroke in zip(self.transitions, self.strokes[1:], strict=True):
            paths += (between, stroke.path)
        return [path for path in paths if path.pieces]

    @cached_property
    def pieces(self) -> Floats:
        """Rows (n, 3) of length (m), curvature (1/m) and sharpness (1/m²) of every piece."""
        return np.array([piece[:3] for path in self.paths for piece in path.pieces])

    @property
    def steps_1pm(self) -> Floats:
        """Steps of curvature (n-1,) (1/m) at the joints between pieces."""
        end = self.pieces[:, 1] + self.pieces[:, 2] * self.pieces[:, 0]
        return np.abs(self.pieces[1:, 1] - end[:-1])

    def continuous_transitions(self) -> tuple[int, int]:
        """Number of transitions that are G² within themselves, and of those that are so with their strokes, too."""
        within = joined = 0
        for before, between, after in zip(self.strokes, self.transitions, self.strokes[1:], strict=False):
            ends = [(p.curvature_1pm, p.curvature_at(p.length_m)) for p in between.pieces]
            inner = all(abs(b[0] - a[1]) <= STEP_1PM for a, b in pairwise(ends))
            first, last = (ends[0][0], ends[-1][1]) if ends else (before.end.curvature_1pm, after.begin.curvature_1pm)
            outer = abs(first - before.end.curvature_1pm) + abs(last - after.begin.curvature_1pm) <= 2 * STEP_1PM
            within += inner
            joined += inner and outer
        return within, joined


def drive(strokes: Sequence[Stroke], contestant: Contestant, sigma_1pm2: float, kappa_1pm: float) -> Drive:
    """Join strokes, in their order, by the contestant's transitions.

    Args:
        strokes: Strokes in driving order.
        contestant: Planner of the transitions.
        sigma_1pm2: Maximum sharpness.
        kappa_1pm: Maximum curvature.

    Raises:
        PlanningError: The contestant fails on two of the strokes.
    """
    method = contestant.method(kappa_1pm, sigma_1pm2)
    transitions = [transition(method, a.end, b.begin) for a, b in pairwise(strokes)]
    return Drive(strokes, transitions)


UNPADDED = Contestant("DPP without padding", lambda kappa, sigma: UnpaddedDubins(kappa))


def study_vehicle() -> Vehicle:
    """Robot of the study, limited only by the wheels' speed and acceleration."""
    vehicle = Vehicle()
    rim_acceleration = vehicle.drive.max_wheel_acceleration_radps2 * vehicle.drive.wheel_radius_m
    return vehicle.changed(
        drive={
            "max_acceleration_mps2": rim_acceleration,
            "planned_wheel_acceleration_radps2": vehicle.drive.max_wheel_acceleration_radps2,
            "max_lateral_acceleration_mps2": 1e3,
        }
    )
