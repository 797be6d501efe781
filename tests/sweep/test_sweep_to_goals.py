"""Sweeps of drives to a goal: the drives of `goto`, how near they come, and what is refused before any."""

import json
import math
import pickle
import sys

import pytest

from tests.sweep.combining import combined
from touchline.cli.commands import execute
from touchline.jobs.goal.arrival import ReachedPose, missed
from touchline.jobs.sweep.combinations import SweepCase
from touchline.jobs.sweep.summary import summarise
from touchline.jobs.sweep.task import SweepRun, perform, prepare
from touchline.schemas.errors import PlanningError, SpecError
from touchline.schemas.messages import PlanOptions, PoseGoal
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.scenario import Scenario
from touchline.schemas.vehicles.shipped import SHIPPED

pytestmark = pytest.mark.xdist_group("small robots")  # its kernels are compiled in one worker

WAFFLE = SHIPPED["turtlebot3-waffle-pi"].vehicle
GOAL = PoseGoal(x_m=0.8, y_m=0.2, heading_rad=0.4)
BY_PURSUIT = "follower=pure-pursuit"


@pytest.fixture
def figures_of(monkeypatch, capsys):
    """The figures that the command gives as JSON."""

    def run(*arguments):
        monkeypatch.setattr("sys.argv", ["touchline", *arguments, "--vehicle", "turtlebot3-waffle-pi", "--json"])
        assert execute() == 0
        out = capsys.readouterr().out
        return json.loads(out[out.index("{") :])

    return run


def test_a_run_is_the_drive_of_goto(figures_of, tmp_path):
    world = tmp_path / "world.json"
    world.write_text(json.dumps({"seed": 7, "start": {"x_m": 0.2, "y_m": -0.1, "heading_rad": 0.3}}))
    to_goal = ("--goal", "0.8,0.2,0.4", "--set", "goal.method=dubins", "--set", BY_PURSUIT, "--workers", "1")
    swept = figures_of("sweep", str(world), *to_goal, "--seeds", "2")
    options = ("--method", "dubins", "--follower", "pure-pursuit", "--scenario", str(world), "--seed", "8")
    alone = figures_of("goto", "0.8", "0.2", "0.4", *options)
    (combination,), (_, run) = swept["combinations"], swept["runs"]
    true, times = alone["arrival"]["true"], alone["arrival"]["time_s"]
    assert (run["seed"], run["success"], run["scenario_hash"]) == (8, True, alone["hash"]["scenario"])
    assert (run["off_m"], run["turned_rad"]) == (true["off_m"], pytest.approx(math.radians(abs(true["turned_deg"]))))
    assert (run["planned_time_s"], run["total_time_s"]) == (times["planned"], times["taken"])
    assert run["position_rmse_m"] == alone["estimator"]["position_rmse_m"]
    assert combination["goal"] == {"x_m": 0.8, "y_m": 0.2, "heading_rad": 0.4}
    assert (combination["runs"], combination["within_2cm_2deg_pct"]) == (2, 100.0)


def test_another_process_drives_the_same_and_any_heading_is_no_wrong_one():
    any_heading = PoseGoal(x_m=0.6, y_m=0.1)
    jobs, (task,) = prepare(combined(BY_PURSUIT, work=any_heading), 1, WAFFLE)
    here = perform(jobs, task)
    assert here.success
    assert "turned_rad" not in here.figures
    assert perform(*pickle.loads(pickle.dumps((jobs, task)))) == here


def test_near_are_those_that_arrive_within_2_cm_and_2_degrees():
    ends = ((True, 0.019, 0.03), (True, 0.021, 0.0), (True, 0.0, 0.036), (False, 0.0, 0.0))
    runs = [
        SweepRun(0, seed, arrived, "", {"off_m": m, "turned_rad": rad}) for seed, (arrived, m, rad) in enumerate(ends)
    ]
    runs.append(SweepRun(0, 9, False, "does not find out where it stands", {}))
    cases = [SweepCase({}, GOAL, Scenario(), OnboardConfig(), PlanOptions())]
    (combination,) = summarise(cases, runs)["combinations"]
    assert combination["within_2cm_2deg_pct"] == 20.0
    assert combination["failed_seeds"] == [3, 9]


def test_goals_are_combined_and_each_is_planned_from_each_start():
    scenario = Scenario(start={"x_m": 0.0, "y_m": 0.0, "heading_rad": 0.0})
    texts = ("goal.x_m=0.8,1.2", "start.heading_rad=0.0,1.0", "goal.tangents_m=[1.5]", "goal.method=cubic", BY_PURSUIT)
    wanted = combined(*texts, "plan.forward_only=true", "camera.white_m=0.02", scenario=scenario, work=GOAL)
    assert [(c.work.x_m, c.scenario.start.heading_rad) for c in wanted] == [(0.8, 0), (0.8, 1), (1.2, 0), (1.2, 1)]
    for case in wanted:
        assert (case.work.y_m, case.work.method, case.work.tangents_m.tolist()) == (0.2, "cubic", [1.5])
        assert (case.options, case.scenario.camera.white_m) == (PlanOptions(forward_only=True), 0.02)
    jobs, tasks = prepare(wanted, 3, WAFFLE)
    assert [task.job for task in tasks] == [0, 0, 0, 1, 1, 1, 2, 2, 2, 3, 3, 3]
    assert [job.goal.x_m for job in jobs] == [0.8, 0.8, 1.2, 1.2]


@pytest.mark.parametrize(
    ("text", "work", "named"),
    [
        ("goal.methd=cubic", GOAL, r"goal\.methd is not a field of a goal; use .*goal\.method"),
        ("goal.duration_s=soon", GOAL, "duration_s is 'soon'"),
        ("plan.paint_speed_mps=1", GOAL, r"plan\.paint_speed_mps is not an option of a plan to a goal; use .*forward"),
        ("plan.start=1", GOAL, r"plan\.start is not"),
        ("template=tennis", GOAL, "template is given beside --goal"),
        ("goal.method=cubic", "study-square", r"goal\.method needs a goal, and there is none; give --goal"),
    ],
)
def test_what_cannot_be_set_is_refused_by_name(text, work, named):
    with pytest.raises(SpecError, match=named):
        combined(text, work=work)


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("goal.method=cubik", 'unknown pose method "cubik"; use one of'),
        ("goal.duration_s=0.5", "give at least"),
        ("goal.x_m=NaN", r"goal\.x_m = nan"),
    ],
)
def test_a_goal_to_which_there_is_no_way_is_refused_before_any_run(text, named):
    with pytest.raises(PlanningError, match=named):
        prepare(combined(text, work=GOAL), 1, WAFFLE)


def test_a_robot_that_rests_beside_its_goal_or_turned_has_not_arrived():
    goal, near = PoseGoal(x_m=1.0, y_m=2.0, heading_rad=3.1), ReachedPose(1.03, 2.03, -3.16)
    assert missed(goal, near, None) == missed(goal, near, near) == ""
    assert missed(goal, near, ReachedPose(1.0, 2.1, 3.1)).startswith("it rests 0.100 m from the goal in truth")
    assert missed(goal, ReachedPose(1.0, 2.0, 3.1 - math.radians(16.7)), near).startswith("it rests 16.7° off")
    any_heading = goal.model_copy(update={"heading_rad": math.nan})
    assert missed(any_heading, ReachedPose(1.0, 2.0, 0.0), None) == ""


def test_a_drive_that_ends_turned_is_no_success(monkeypatch, capsys):
    arguments = ("goto", "--vehicle", "clay-roller", "--json", "--", "0.3", "0", "-1")
    monkeypatch.setattr(sys, "argv", ["touchline", *arguments])
    assert execute() == 1
    assert json.loads(capsys.readouterr().out)["reason"].startswith("it rests 3.1° off the goal's heading")
