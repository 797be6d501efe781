"""A transition method related to none of ours is planned with all that its interface says: cusps and prices, too."""

from collections.abc import Iterator, Sequence

import numpy as np
import pytest

from tests.planner.drawn import box, drawn
from tests.planner.test_standing import AGILE, check, comb
from touchline.schemas.messages import PlanOptions
from touchline.schemas.plugins import METHODS
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.collision.checker import CollisionChecker
from touchline.services.planner.collision.via_poses import ClosedEnds, detours
from touchline.services.planner.geometry.clothoid import Floats, PathPose, Piece
from touchline.services.planner.limits import Limits
from touchline.services.planner.plan import plan
from touchline.services.planner.steering.g2 import Steering
from touchline.services.planner.steering.method import CurveEnd
from touchline.services.planner.transitions.method_choice import Method, method_of
from touchline.services.planner.transitions.pricing import OneByOne, pricing_of
from touchline.services.planner.transitions.transitions import Pricing, Transition, TransitionFamily


class Shuttle:
    """Another's method: it borrows the geometry of `g2`, but has nothing of its class."""

    name = "shuttle"

    def __init__(self, curvature_max_1pm: float, sharpness_max_1pm2: float) -> None:
        self._inner = Steering(curvature_max_1pm, sharpness_max_1pm2)

    def lead_in(self, curvature_1pm: float) -> tuple[Piece, ...]:
        return self._inner.lead_in(curvature_1pm)

    def lead_out(self, curvature_1pm: float) -> tuple[Piece, ...]:
        return self._inner.lead_out(curvature_1pm)

    def connect(self, start: PathPose, goal: PathPose) -> tuple[Piece, ...]:
        return self._inner.connect(start, goal)

    def between(self, start: CurveEnd, goal: CurveEnd) -> tuple[Piece, ...]:
        return self._inner.between(start, goal)

    def standing_transitions(self, start: CurveEnd, goal: CurveEnd, room_m: float = 0.0) -> list[tuple[Piece, ...]]:
        return self._inner.standing_transitions(start, goal, room_m)


class OneSided(OneByOne):
    """Prices as if nothing south of a line could be reached in any time."""

    def __init__(self, south_m: float) -> None:
        self.south_m = south_m

    def rough_s(self, transitions: TransitionFamily, ends: Sequence[CurveEnd], begins: Sequence[CurveEnd]) -> Floats:
        south = np.array([begin.pose.y_m < self.south_m for begin in begins])
        return np.where(south, 1e3, 0.0) + super().rough_s(transitions, ends, begins)


@pytest.fixture
def shuttle() -> Iterator[str]:
    METHODS.register("shuttle", "there and back", Method(lambda limits: TransitionFamily.of_one(Shuttle, limits)))
    yield "shuttle"
    METHODS.forget("shuttle")


def test_another_methods_cusps_are_driven_where_they_are_quicker(shuttle: str) -> None:
    planned = plan(comb(), AGILE, PlanOptions(method=shuttle))
    check(planned)
    assert planned.report.cusps + planned.report.spins > 0
    forward = plan(comb(), AGILE, PlanOptions(method=shuttle, forward_only=True))
    assert (forward.report.cusps, forward.report.spins) == (0, 0)
    assert planned.report.total_time_s < forward.report.total_time_s


class Asked(TransitionFamily):
    """Remembers to which poses in between a transition was asked for."""

    def __init__(self, shipped: TransitionFamily, pricing: Pricing) -> None:
        super().__init__(shipped.limits, shipped.turns, pricing=pricing)
        object.__setattr__(self, "middles", [])

    def between(self, start: CurveEnd, goal: CurveEnd) -> list[Transition]:
        if start == START:
            self.middles.append(goal)
        return super().between(start, goal)


START, GOAL = CurveEnd(PathPose(8.0, 0.0, 0.0), 0.0), CurveEnd(PathPose(14.0, 2.0, 0.0), 0.0)


@pytest.mark.parametrize("south_m", [-0.5, 2.5])
def test_poses_in_between_are_tried_by_the_times_of_the_method(south_m: float) -> None:
    vehicle, options = Vehicle(), PlanOptions(method="ccd")
    wall = drawn((0, 0, 8, 0), obstacles=(box((11.0, -1.2), (11.4, 3.2), "wall"),))
    checker = CollisionChecker.of(wall, vehicle)
    assert checker
    transitions = Asked(method_of(options).transitions(Limits.of(vehicle, options)), OneSided(south_m))
    offered = list(detours(START, GOAL, transitions, checker, ClosedEnds()))
    assert offered
    assert not any(checker.collision(transition.path) for transition in offered)
    assert all(middle.pose.y_m >= south_m for middle in transitions.middles)
    price = pricing_of(transitions).rough_s
    around = price(transitions, [START], transitions.middles)[0] + price(transitions, transitions.middles, [GOAL])[:, 0]
    assert np.all(np.diff(around) >= -1e-9)


@pytest.mark.parametrize("name", METHODS.names())
def test_what_dialogs_say_of_empty_limits_is_what_holds(name: str) -> None:
    by_the_wheels = method_of(PlanOptions(method=name)).by_dynamics
    for option in ("kappa_max_1pm", "sigma_max_1pm2"):
        assert (METHODS.empty(name, option) is not None) == by_the_wheels
    assert METHODS.empty(name, "paint_speed_mps") is None
