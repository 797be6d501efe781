"""Sweeps: which runs, the same wherever they happen, and what is said about them."""

import csv
from pathlib import Path

import pytest

from tests.sweep.combining import combined
from tests.sweep.worker_tasks import divide
from touchline.jobs.sweep.combinations import SweepCase
from touchline.jobs.sweep.summary import statistics, summarise, write_csv
from touchline.jobs.sweep.task import SweepRun, lost_run, perform, prepare
from touchline.jobs.task_pool import here, in_processes
from touchline.schemas.errors import SpecError
from touchline.schemas.messages import PlanOptions
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.scenario import Scenario
from touchline.schemas.spec import parse, read_text
from touchline.schemas.vehicles import Vehicle

pytestmark = pytest.mark.xdist_group("sweep")  # by one worker, so that what is compared is run once
SMALL_ROBOT = Path(__file__).parents[2] / "examples" / "small-robot.json"


def test_every_combination_once():
    found = combined("follower=mpc,pure-pursuit", "gnss.white_m=0.005,0.01,0.02", "plan.paint_speed_mps=0.8")
    assert [(c.config.follower, c.scenario.gnss.white_m) for c in found] == [
        (follower, white) for follower in ("mpc", "pure-pursuit") for white in (0.005, 0.01, 0.02)
    ]
    assert {c.options.paint_speed_mps for c in found} == {0.8}
    assert found[0].setting == {"follower": "mpc", "gnss.white_m": 0.005, "plan.paint_speed_mps": 0.8}
    assert [case.setting for case in combined()] == [{}]


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("follower", "NAME=VALUE"),
        ("follower=mpc,", "NAME=VALUE"),
        ("follower=bang-bang", "follower"),
        ("gnss.white=1", "gnss.white"),
        ("gps.white_m=1", "gps"),
        ("gnss.white_m=-1", "white_m"),
        ("onboard.gnss.white=1", "onboard.gnss.white is not a field of a robot's computer"),
        ("onboard.gnss.white_m=-1", "white_m"),
        ("plan.speed=1", "plan.paint_speed_mps"),
        ("plan.paint_speed_mps=fast", "paint_speed_mps is 'fast'"),
        ("plan.start=3", "start is 3"),
    ],
)
def test_what_cannot_be_set_is_refused_by_name(text, named):
    with pytest.raises(SpecError, match=named):
        combined(text)
    with pytest.raises(SpecError, match="twice"):
        combined("seed=1", "seed=2")


def test_a_plan_is_made_once_per_template_and_options():
    methods, speeds = "plan.method=ccd,dubins-padded", "plan.paint_speed_mps=0.8,1.0"
    wanted = combined("template=study-square,tennis", "follower=mpc,pure-pursuit", methods)
    wanted += combined("template=study-square", speeds)
    jobs, tasks = prepare(wanted, 3)
    assert len(jobs) == 6
    assert len(tasks) == len(wanted) * 3
    assert {task.scenario.seed for task in tasks} == {1, 2, 3}
    for task in tasks:
        job, case = jobs[task.job], wanted[task.case]
        assert (job.template.name, job.options) == (case.work, case.options)
        assert task.config == case.config


@pytest.fixture(scope="module")
def ran():
    wanted = combined("follower=mpc,pure-pursuit", scenario=Scenario(seed=7))
    jobs, tasks = prepare(wanted, 2, parse(Vehicle, read_text(SMALL_ROBOT), SMALL_ROBOT.name))
    return wanted, jobs, tasks, list(here(perform, jobs, tasks))


def test_another_process_gives_the_same_figures(ran):
    wanted, jobs, tasks, alone = ran
    some = slice(1, 3)  # one of each combination
    spread = list(in_processes(perform, jobs, tasks[some], 1, lost_run))
    assert summarise(wanted, spread) == summarise(wanted, alone[some])
    assert len({run.scenario_hash for run in alone}) == 4


def test_what_is_done_so_far_can_be_had(ran):
    wanted, _, _, alone = ran
    place = in_processes(divide, 6.0, [2.0, 3.0], 1, lambda _number, why: why)
    assert next(place) in (2.0, 3.0)
    place.close()
    report = summarise(wanted, alone[:1])
    assert [combination["runs"] for combination in report["combinations"]] == [1, 0]


def test_the_report_and_its_csv(ran, tmp_path):
    wanted, _, _, alone = ran
    report = summarise(wanted, list(reversed(alone)))
    assert [(run["set"]["follower"], run["seed"]) for run in report["runs"]] == [
        ("mpc", 7),
        ("mpc", 8),
        ("pure-pursuit", 7),
        ("pure-pursuit", 8),
    ]
    write_csv(report, tmp_path / "runs.csv")
    text = (tmp_path / "runs.csv").read_text()
    assert text.startswith("follower,seed,success,reason,scenario_hash,coverage_pct")
    rows = list(csv.DictReader(text.splitlines()))
    assert [(row["follower"], row["seed"]) for row in rows[:3]] == [("mpc", "7"), ("mpc", "8"), ("pure-pursuit", "7")]
    assert [float(row["gap_m"]) for row in rows] == [run["gap_m"] for run in report["runs"]]


def test_the_worst_is_the_least_coverage_and_the_largest_error():
    runs = [
        SweepRun(0, seed, True, "", {"coverage_pct": 100.0 - seed, "gap_m": float(seed % 10)}) for seed in range(1, 21)
    ]
    coverage, gap = statistics("coverage_pct", runs), statistics("gap_m", runs)
    assert (coverage["worst"], coverage["worst_seed"]) == (80.0, 20)
    assert (gap["worst"], gap["worst_seed"]) == (9.0, 9)
    assert coverage["p95"] == pytest.approx(80.95)
    assert coverage["mean"] == pytest.approx(89.5)


def test_a_figure_that_only_some_runs_have_is_told_of_those():
    runs = [
        SweepRun(0, 1, True, "", {"time_s": 20.0, "arrived_s": 20.0}),
        SweepRun(0, 2, False, "not there", {"time_s": 150.0}),
    ]
    for given in (runs, runs[::-1]):
        report = summarise([SweepCase({}, "t", Scenario(), OnboardConfig(), PlanOptions())], given)
        figures = report["combinations"][0]["figures"]
        assert figures["time_s"]["mean"] == 85.0
        assert (figures["arrived_s"]["mean"], figures["arrived_s"]["worst_seed"]) == (20.0, 1)


def test_a_run_that_could_not_be_done_is_told_and_not_counted():
    runs = [
        SweepRun(0, 1, True, "", {"gap_m": 1.0}),
        SweepRun(0, 2, False, "refused", {}),
        SweepRun(0, 3, False, "", {"gap_m": 3.0}),
    ]
    (combination,) = summarise([SweepCase({}, "t", Scenario(), OnboardConfig(), PlanOptions())], runs)["combinations"]
    assert (combination["runs"], combination["failed_seeds"]) == (3, [2, 3])
    assert combination["figures"]["gap_m"]["mean"] == 2.0
