"""Plug-ins of others that give what nothing can be planned with: an error names them, and no kernel is handed it."""

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from touchline.schemas.catalogue import load_template, load_vehicle
from touchline.schemas.curves import Curve
from touchline.schemas.errors import PlanningError
from touchline.schemas.messages import PlanOptions, PoseGoal
from touchline.schemas.plugins import AREA_METHODS, METHODS, POSE_METHODS, SPEED_LAWS, Registry
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.coverage.area_method import CoverageMethod
from touchline.services.planner.coverage.coverage_methods import ZIGZAG
from touchline.services.planner.geometry.clothoid import PathPose, Piece, PiecePath
from touchline.services.planner.goal_plan import plan_to_goal
from touchline.services.planner.plan import plan
from touchline.services.planner.poses.pose_method import PosePath
from touchline.services.planner.poses.shipped_methods import G2
from touchline.services.planner.poses.speed_laws import QUINTIC, SpeedLaw
from touchline.services.planner.steering.ccd import ContinuousDubins
from touchline.services.planner.transitions.method_choice import Method
from touchline.services.planner.transitions.pricing import OneByOne
from touchline.services.planner.transitions.transitions import TransitionFamily

LAWN = Template.model_validate({"name": "lawn", "areas": [{"id": "lawn", "outline": [[0, 0], [7, 0], [7, 6], [0, 6]]}]})
TO_GOAL = PlanOptions(start=np.zeros(3))


@pytest.fixture
def registered() -> Iterator[Any]:
    """Registers a plug-in under the name `theirs`."""
    taken: list[Registry[Any]] = []

    def register(registry: Registry[Any], plugin: Any) -> None:
        registry.register("theirs", "", plugin)
        taken.append(registry)

    yield register
    for registry in taken:
        registry.forget("theirs")


def turning(between: Any = None, **answers: Any) -> Method:
    """CC turns, but for what is given."""
    given = {**answers, **({"between": between} if between else {})}
    made = type("Theirs", (ContinuousDubins,), {"name": "theirs", **given})
    return Method(lambda limits: TransitionFamily.of_one(made, limits))


def spoiled(**changes: Any) -> Any:
    """The CC turns between two poses, each piece with something changed."""

    def between(self: ContinuousDubins, start: Any, goal: Any) -> tuple[Piece, ...]:
        return tuple(piece._replace(**changes) for piece in ContinuousDubins.between(self, start, goal))

    return between


class Wild:
    """Prices that are not finite."""

    part, looks_closer = 50, False

    rough_s = OneByOne.rough_s

    def timer(self, transitions: Any, ends: Any, begins: Any) -> Any:
        timed = OneByOne().timer(transitions, ends, begins)
        return lambda pairs, closer: timed(pairs, closer)._replace(seconds=np.full(len(pairs), math.nan))


METHODS_OF_OTHERS = {
    "a NaN length": (turning(spoiled(length_m=math.nan)), "'length_m': nan"),
    "a negative length": (turning(spoiled(length_m=-1.0)), "'length_m': -1.0"),
    "no direction": (turning(spoiled(direction=0)), "'direction': 0"),
    "a way to elsewhere": (turning(spoiled(sharpness_1pm2=0.0)), "from its goal"),
    "nothing": (turning(lambda _self, _start, _goal: None), "a NoneType instead of pieces"),
    "numbers": (turning(lambda _self, _start, _goal: [(1.0, 0.0)]), "a list instead of pieces"),
    "no lead-in": (turning(lead_in=lambda _self, _curvature: 3.0), "it fails with TypeError"),
    "no method": (42, "42, not a Method"),
    "no transitions": (Method(lambda _limits: None), "it has no transitions"),  # type: ignore[arg-type, return-value]
    "wild prices": (
        Method(lambda limits: TransitionFamily.of_one(ContinuousDubins, limits, Wild())),
        "not finite",
    ),
}


@pytest.mark.parametrize("flaw", METHODS_OF_OTHERS)
def test_a_transition_method(flaw: str, registered: Any) -> None:
    method, told = METHODS_OF_OTHERS[flaw]
    registered(METHODS, method)
    with pytest.raises(PlanningError) as caught:
        plan(load_template("study-square"), Vehicle(), PlanOptions(method="theirs"))
    assert 'cannot use the transition method "theirs"' in str(caught.value)
    assert told in str(caught.value)


AREAS_OF_OTHERS = {
    "NaN": (lambda _area, _width_m: [Curve.from_line((0.0, math.nan), (1.0, 2.0))], "swath 1 of the area"),
    "None": (lambda _area, _width_m: None, "a NoneType instead of lines and arcs"),
    "tuples": (lambda _area, _width_m: [(0, 0, 1, 1)], "a tuple instead of a line"),
    "elsewhere": (lambda _area, _width_m: [Curve.from_line((-500.0, 0.0), (-400.0, 0.0))], "leads out of the area"),
    "an arc round the corner": (
        lambda _area, _width_m: [Curve.from_arc((1.0, 1.0), (1.0, 4.0), -6.0)],
        "leads out of the area",
    ),
    "an exception": (lambda _area, width_m: width_m / 0, "it fails with ZeroDivisionError: float division by zero"),
    "no function": (3, "3, neither a function"),
    "no route": (CoverageMethod(lambda _task, _progress: None), "instead of a CoverageRoute"),  # type: ignore[arg-type, return-value]
}


@pytest.mark.parametrize("flaw", AREAS_OF_OTHERS)
def test_an_area_method(flaw: str, registered: Any) -> None:
    method, told = AREAS_OF_OTHERS[flaw]
    registered(AREA_METHODS, method)
    covers = isinstance(method, CoverageMethod)
    with pytest.raises(PlanningError) as caught:
        plan(LAWN, load_vehicle("clay-roller" if covers else "turf-tank-two"), PlanOptions(area_method="theirs"))
    assert 'cannot use the area method "theirs"' in str(caught.value)
    assert told in str(caught.value)


def test_a_swath_in_the_corner_that_an_area_does_not_have_leads_out_of_it(registered: Any) -> None:
    corner = [[0, 0], [9, 0], [9, 3], [3, 3], [3, 8], [0, 8]]
    area = Template.model_validate({"name": "L", "areas": [{"id": "L", "outline": corner}]})
    registered(AREA_METHODS, lambda _area, _width_m: [Curve.from_line((5.0, 6.0), (8.0, 6.0))])
    with pytest.raises(PlanningError, match='swath 1 leads out of the area "L"'):
        plan(area, Vehicle(), PlanOptions(area_method="theirs"))


@pytest.mark.parametrize("flaw", ["a jump", "a NaN curvature", "none"])
def test_the_route_of_a_coverage_method(flaw: str, registered: Any) -> None:
    def cover(task: Any, progress: Any) -> Any:
        route = ZIGZAG.cover(task, progress)
        first, *rest = route.pieces
        if flaw == "a jump":
            path = rest[-1].path
            rest[-1] = replace(rest[-1], path=PiecePath(path.start._replace(x_m=path.start.x_m + 0.1), path.pieces))
        if flaw == "a NaN curvature":
            parts = tuple(part._replace(curvature_1pm=math.nan) for part in rest[-1].path.pieces)
            rest[-1] = replace(rest[-1], path=PiecePath(rest[-1].path.start, parts))
        return replace(route, pieces=(first, *rest))

    registered(AREA_METHODS, CoverageMethod(cover))
    options = PlanOptions(area_method="theirs")
    if flaw == "none":
        assert plan(LAWN, load_vehicle("clay-roller"), options).report.coverage
        return
    with pytest.raises(PlanningError, match='cannot use the area method "theirs"'):
        plan(LAWN, load_vehicle("clay-roller"), options)


class PoseMethodOf:
    """The shipped method g2, with its path changed."""

    def __init__(self, change: Any) -> None:
        self._change = change

    def between(self, start: PathPose, goal: PathPose, traveller: Any) -> Any:
        return self._change(G2.between(start, goal, traveller))


def with_pieces(way: PosePath, pieces: tuple[Piece, ...]) -> PosePath:
    return replace(way, path=PiecePath(way.path.start, pieces))


POSES_OF_OTHERS = {
    "NaN": lambda way: with_pieces(way, tuple(piece._replace(length_m=math.nan) for piece in way.path.pieces)),
    "part of it": lambda way: with_pieces(way, way.path.pieces[:1]),
    "from elsewhere": lambda way: replace(way, path=PiecePath(PathPose(9.0, 9.0, 0.0), way.path.pieces)),
    "a path alone": lambda way: way.path,
    "None": lambda _way: None,
}


@pytest.mark.parametrize("flaw", POSES_OF_OTHERS)
def test_a_pose_method(flaw: str, registered: Any) -> None:
    registered(POSE_METHODS, PoseMethodOf(POSES_OF_OTHERS[flaw]))
    goal = PoseGoal(x_m=5.0, y_m=3.0, heading_rad=1.5, method="theirs")
    with pytest.raises(PlanningError, match='cannot use the pose method "theirs"'):
        plan_to_goal(goal, Vehicle(), TO_GOAL)


LAWS_OF_OTHERS = {
    "NaN": SpeedLaw(lambda tau: tau * math.nan, lambda tau: tau),
    "backwards": SpeedLaw(lambda tau: 1.0 - tau, lambda tau: -np.ones_like(tau)),
    "a jump": SpeedLaw(lambda tau: np.where(tau > 0.5, 1.0, 0.0), lambda tau: 0.0 * tau),
    "a scalar": SpeedLaw(lambda _tau: 1.0, lambda _tau: 1.0),  # type: ignore[arg-type, return-value]
    "no law": 3,
}


@pytest.mark.parametrize("flaw", LAWS_OF_OTHERS)
def test_a_speed_law(flaw: str, registered: Any) -> None:
    registered(SPEED_LAWS, LAWS_OF_OTHERS[flaw])
    goal = PoseGoal(x_m=5.0, y_m=3.0, heading_rad=1.5, method="cubic", law="theirs")
    with pytest.raises(PlanningError, match='cannot use the speed law "theirs"'):
        plan_to_goal(goal, Vehicle(), TO_GOAL)


def test_sound_ones_plan_the_same_as_unguarded(registered: Any) -> None:
    registered(POSE_METHODS, PoseMethodOf(lambda way: way))
    registered(SPEED_LAWS, QUINTIC)
    made = [
        plan_to_goal(PoseGoal(x_m=5.0, y_m=3.0, heading_rad=1.5, method=method, law=law), Vehicle(), TO_GOAL)
        for method, law in (("theirs", "theirs"), ("g2", "quintic"))
    ]
    assert made[0].trajectory == made[1].trajectory
    registered(METHODS, METHODS.find("ccd"))
    plans = [plan(load_template("study-square"), Vehicle(), PlanOptions(method=name)) for name in ("theirs", "ccd")]
    assert plans[0].report.total_time_s == plans[1].report.total_time_s
