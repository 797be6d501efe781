"""Goals behind things that the plan does not know: ways are planned anew from what the lidar sees."""

import math
from typing import Any
from unittest.mock import Mock

import pytest

from tests.way_round.met import LIDAR
from tests.way_round.walls import wall
from touchline.jobs.goal import goal_rerouting
from touchline.jobs.goal.goal_simulation import GoalDrive, drive_to_goal
from touchline.jobs.single.simulation import Products
from touchline.schemas.catalogue import load_vehicle
from touchline.schemas.known_ground import OPEN_GROUND, KnownGround, KnownObstacle
from touchline.schemas.messages import PlanOptions, PoseGoal
from touchline.schemas.scenario import Scenario
from touchline.schemas.setup import Setup
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.goal_plan import plan_to_goal
from touchline.services.robot_sim.goal_way import goal_pursuit

GOAL = PoseGoal(x_m=12.0, y_m=0.0, heading_rad=math.nan)
PROTECT = {"mode": "protect"}


def going(
    *objects: dict[str, Any],
    hashed: bool = False,
    seed: int = 5,
    ground: KnownGround = OPEN_GROUND,
    goal: PoseGoal = GOAL,
    **vehicle: Any,
) -> GoalDrive:
    """A drive of the marker from the origin to a goal in a world with these objects, over ground that is known."""
    robot = Vehicle.model_validate({"name": "marker", "sensors": [LIDAR], "protection": PROTECT, **vehicle})
    scenario = Scenario.model_validate(
        {"seed": seed, "start": {"x_m": 0.0, "y_m": 0.0, "heading_rad": 0.0}, "objects": objects}
    )
    setup, products = Setup(vehicle=robot, scenario=scenario), Products(hashed=hashed)
    return drive_to_goal(setup, goal, PlanOptions(), products, ground=ground)


def hits(done: GoalDrive) -> int:
    """Contacts of the moving robot."""
    return 0 if done.contacts is None else done.contacts.while_moving


def is_shut_off(done: GoalDrive) -> bool:
    """True if the reason is that no way exists; it names no place if only a breach would help."""
    return "no way exists" in done.problem or "shut off on all sides" in done.problem


def test_who_runs_into_the_robot_is_in_the_report() -> None:
    done = going({"kind": "dog", "x_m": 3.0, "y_m": 2.0, "motion": {"kind": "intercept"}})
    contacts = done.figures()["contacts"]
    assert contacts["each"][0]["thing"].startswith("dog")
    assert contacts["while_moving"] + contacts["at_rest"] == len(contacts["each"]) and "bumper" in done.problem


def test_a_robot_finds_the_gap_in_a_wall() -> None:
    done = going(*wall((6.0, -8.0), (6.0, 1.5)), *wall((6.0, 3.5), (6.0, 8.0)))
    assert not done.problem
    assert not hits(done)
    assert done.outcome.earlier  # the first way led into the wall


def test_a_robot_leaves_a_dead_end_that_it_sees_only_inside() -> None:
    short = {**LIDAR, "max_m": 4.0, "dark_m": 4.0}
    done = going(*wall((2.0, 2.0), (9.0, 2.0), (9.0, -2.0), (2.0, -2.0)), sensors=[short])
    assert not done.problem
    assert not hits(done)


def test_a_robot_goes_on_after_a_person_who_crosses() -> None:
    person = {"kind": "person", "name": "passer-by", "x_m": 5.0, "y_m": -6.0}
    motion = {"kind": "path", "points": [[5.0, 8.0]], "speed_mps": 1.0, "start_s": 4.0}
    done = going({**person, "motion": motion}, protection={"mode": "passive"})
    assert not done.problem
    assert not hits(done)


def test_a_robot_waits_for_a_person_who_walks_to_and_fro_before_it(monkeypatch: pytest.MonkeyPatch) -> None:
    plans = Mock(side_effect=plan_to_goal)
    monkeypatch.setattr(goal_rerouting, "plan_to_goal", plans)
    paces = [[1.3, 0.6], [1.3, -0.6]] * 9  # for 27 s, nearer than the robot may have somebody to move
    person = {"kind": "person", "name": "groundsman", "x_m": 1.3, "y_m": -0.6}
    motion = {"kind": "path", "points": [*paces, [1.3, -20.0]], "speed_mps": 0.8}
    done = going({**person, "motion": motion}, protection={"mode": "passive"})
    assert not done.problem
    assert not hits(done)
    assert plans.call_count < 20


def test_a_robot_in_a_closed_room_is_told_that_no_way_leads_out(monkeypatch: pytest.MonkeyPatch) -> None:
    plans = Mock(side_effect=plan_to_goal)
    monkeypatch.setattr(goal_rerouting, "plan_to_goal", plans)
    done = going(*wall((-2.5, -2.5), (2.5, -2.5), (2.5, 2.5), (-2.5, 2.5), (-2.5, -2.5)))
    assert is_shut_off(done)
    assert not hits(done)
    assert plans.call_count < 45  # it does not try all margins again each time


@pytest.mark.full  # it looks at all four sides, and the proof takes ten seconds
def test_a_closed_room_is_told_as_no_way() -> None:
    done = going(*wall((10.0, -2.0), (14.0, -2.0), (14.0, 2.0), (10.0, 2.0), (10.0, -2.0)))
    assert is_shut_off(done)
    assert not hits(done)


def test_without_unknown_things_the_way_is_the_planned_one() -> None:
    done = going()
    assert not done.outcome.earlier


def test_the_same_scenario_gives_the_same_session() -> None:
    across = wall((6.0, -2.0), (6.0, 2.0))
    first, second = (going(*across, hashed=True).outcome.report.session_hash for _ in range(2))
    assert first == second != ""


def test_a_robot_with_odometry_alone_goes_round_things() -> None:
    jackal = load_vehicle("examples/vehicles/jackal-lidar.json").model_dump()
    done = going(*wall((6.0, -2.0), (6.0, 2.0)), **jackal)
    assert done.outcome.report.success
    assert done.true.off_m(GOAL) < 0.3
    assert not hits(done)


@pytest.mark.parametrize("seed", [pytest.param(5, marks=pytest.mark.full), pytest.param(6, marks=pytest.mark.full), 11])
def test_a_robot_among_what_may_move_goes_round_where_it_may_pass(seed: int) -> None:
    gap = (*wall((6.0, -9.0), (6.0, 1.5)), *wall((6.0, 3.5), (6.0, 8.0)))  # it may not pass in the gap of 2 m
    done = going(*gap, seed=seed, protection={"mode": "passive"})
    assert not done.problem
    assert not hits(done)
    from_rest = [each for each in done.outcome.earlier if each.reason == goal_pursuit.GO_ROUND]
    assert len(from_rest) <= 1  # protection lets it drive the ways that it plans


@pytest.mark.parametrize("seed", [pytest.param(1, marks=pytest.mark.full), 3])
def test_a_robot_that_begins_before_the_end_of_a_wall_goes_round_it(seed: int) -> None:
    done = going(*wall((1.15, -3.0), (1.15, 0.2)), seed=seed)  # 0.3 m before its nose, with its heading not yet known
    assert not done.problem
    assert not hits(done)
    from_rest = [each for each in done.outcome.earlier if each.reason == goal_pursuit.GO_ROUND]
    assert len(from_rest) <= 5  # protection lets it drive the ways that it plans


@pytest.mark.parametrize(
    "corners", [((-3.0, -0.75), (3.0, -0.75)), ((-0.7, 4.15), (-0.7, -0.85), (4.3, -0.85))], ids=["beside", "corner"]
)
def test_a_robot_that_begins_beside_a_wall_or_in_a_corner_gets_away(corners: tuple[tuple[float, float], ...]) -> None:
    done = going(*wall(*corners), seed=1)  # 0.2 m from one wall, 0.3 m from two
    assert not done.problem
    assert not hits(done)


def test_a_robot_in_a_dead_lane_with_the_goal_behind_it_backs_out() -> None:
    lane = wall((-3.0, 0.75), (3.0, 0.75), (3.0, -0.75), (-3.0, -0.75))  # 1.4 m: in it the marker cannot turn round
    done = going(*lane, goal=PoseGoal(x_m=-12.0, y_m=0.0, heading_rad=math.nan))
    assert not done.problem
    assert not hits(done)


@pytest.mark.parametrize("known", [True, False])
def test_a_robot_leaves_a_wall_beside_it_only_if_the_plan_knows_that_it_stands(known: bool) -> None:
    beside = KnownObstacle(id="wall", corners=((-6.0, -0.75), (6.0, -0.75), (6.0, -0.65), (-6.0, -0.65)))
    ground = KnownGround(obstacles=(beside,)) if known else OPEN_GROUND
    done = going(*wall((-6.0, -0.7), (6.0, -0.7)), seed=1, ground=ground, protection={"mode": "passive"})
    assert not hits(done)
    if known:
        assert not done.problem
    else:
        assert "something that may move is 0.1 m from the robot, which needs" in done.problem
