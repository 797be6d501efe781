"""In one process: the bits of the whole system, without it."""

import json
import multiprocessing
import os
import signal
from contextlib import nullcontext
from pathlib import Path

import pytest

from tests.system import commands
from touchline.cli import sweep_command
from touchline.recordings.compare import compare
from touchline.recordings.reader import RecordingReader
from touchline.schemas.cdr import decode
from touchline.schemas.messages import String
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.scenario import Scenario
from touchline.schemas.setup import Setup
from touchline.schemas.spec import parse
from touchline.schemas.vehicles import Vehicle

SMALL_ROBOT = Path(__file__).parents[2] / "examples" / "small-robot.json"
CALM = {"seed": 3, "gnss": {"white_m": 0.001, "burst_share": 0.0}}
COMPUTER = {
    "follower": "pure-pursuit",
    "gnss": {"white_m": 0.001, "gauss_markov_2_m": 0.0, "antenna_sigma_m": 0.0, "stamp_offset_sigma_s": 0.0},
    "imu": {"gyro_scale_sigma": 0.0},
    "drive": {"side_slip_m_rtm": 0.001},
}
LAID = ("--place", "3,4,30", "--origin", "57.01,9.99", "--paint-speed", "0.4", "--forward-only")
WALL_CLOCK = ("wall_time_s", "real_time_factor")


CORNER = {
    "name": "corner",
    "segments": [
        {"id": "a", "line": {"start": [0, 0], "end": [0.8, 0]}},
        {"id": "b", "line": {"start": [0.8, 0], "end": [0.8, 0.8]}},
    ],
}


@pytest.fixture(scope="module")
def corner(tmp_path_factory):
    """A short job with a robot, a world, a computer and a place of its own."""
    folder = tmp_path_factory.mktemp("files")
    template, scenario, computer = (folder / f"{name}.json" for name in ("corner", "calm", "computer"))
    template.write_text(json.dumps(CORNER))
    scenario.write_text(json.dumps(CALM))
    computer.write_text(json.dumps(COMPUTER))
    files = ("--scenario", str(scenario), "--onboard", str(computer), "--vehicle", str(SMALL_ROBOT))
    return (str(template), "--json", *files, *LAID)


@pytest.fixture(scope="module")
def over_zenoh(corner, tmp_path_factory):
    recording = tmp_path_factory.mktemp("run") / "run.mcap"
    return run_of(*corner, "--record", str(recording)), recording


def run_of(*options):
    """Output of a run with real processes."""
    return commands.figures(commands.touchline("run", *options))


@pytest.fixture
def simulation_of(touchline):
    """Output of a simulation in this process."""

    def run(*options):
        code, out, err = touchline("simulate", *options)
        assert code == 0, err
        return json.loads(out)

    return run


@pytest.mark.xdist_group("over-zenoh")  # one worker runs it
def test_a_simulation_says_byte_for_byte_what_a_run_says(over_zenoh, corner, simulation_of, tmp_path):
    run, recorded = over_zenoh
    recording = tmp_path / "simulation.mcap"
    simulation = simulation_of(*corner, "--record", str(recording))
    assert simulation["hash"] == run["hash"]
    assert len(run["hash"]["session"]) == len(run["hash"]["scenario"]) == 16
    comparison = compare(recorded, recording)
    assert comparison.identical, "\n".join(comparison.lines())


@pytest.mark.xdist_group("over-zenoh")  # one worker runs it
def test_a_recording_says_which_robot_lived_in_which_world(over_zenoh):
    _, recorded = over_zenoh
    (told,) = RecordingReader(recorded).messages({"/tt2/setup"})
    setup = parse(Setup, decode(String, told.payload).data, recorded.name)
    origin = setup.scenario.origin
    assert (origin.latitude_deg, origin.longitude_deg) == (57.01, 9.99)
    assert setup == Setup(
        vehicle=parse(Vehicle, SMALL_ROBOT.read_text(), SMALL_ROBOT.name),
        scenario=Scenario(**CALM, name=setup.scenario.name, origin=origin),
        onboard=OnboardConfig(**COMPUTER),
    )


@pytest.mark.xdist_group("over-zenoh")  # one worker runs it
def test_the_figures_are_the_same_with_and_without_telemetry(over_zenoh, corner, simulation_of):
    run, _ = over_zenoh
    simulation = simulation_of(*corner)
    assert simulation["hash"] == {"scenario": run["hash"]["scenario"], "session": None}
    assert simulation["plan"]["max"] == run["plan"]["max"]
    for part in ("paint", "segments", "estimator"):
        assert simulation[part] == run[part]
    for report in (run, simulation):
        for name in WALL_CLOCK:
            del report["traversal"][name]
    assert simulation["traversal"] == run["traversal"]


@pytest.mark.xdist_group("over-zenoh")  # one worker runs it
def test_files_and_options_are_lived_by_all_processes_of_a_run(over_zenoh, corner, simulation_of):
    run, _ = over_zenoh
    usual = simulation_of(corner[0], "--json", "--seed", "7", "--noise", "none")
    assert run["hash"]["scenario"] != usual["hash"]["scenario"]
    assert run["plan"]["max"] != usual["plan"]["max"]
    assert (run["vehicle"], run["seed"], run["follower"]) == ("small-robot", 3, "pure-pursuit")
    assert run["plan"]["time_s"]["paint"] == pytest.approx(1.6 / 0.4)
    assert run["plan"]["standstills"]["cusps"] == 0 < usual["plan"]["standstills"]["cusps"]
    assert simulation_of(*corner, "--hash", "--seed", "5")["hash"] != run["hash"]


@pytest.mark.xdist_group("over-zenoh")  # one worker runs it
def test_a_recording_is_drawn(over_zenoh, touchline, tmp_path):
    _, recorded = over_zenoh
    picture = tmp_path / "painted.svg"
    code, _, err = touchline("picture", str(recorded), "--out", str(picture))
    assert code == 0, err
    drawn = picture.read_text()
    assert "nozzle off the template" in drawn
    assert touchline("picture", str(recorded), "--out", "painted.gif")[0] == 2
    assert touchline("picture", str(picture), "--out", str(picture))[0] == 2


def test_a_sweep_from_the_command_line(touchline, simulation_of, tmp_path):
    scenario, report, csv = tmp_path / "calm.json", tmp_path / "report.json", tmp_path / "runs.csv"
    scenario.write_text(json.dumps({"seed": 3, "gnss": {"white_m": 0.001}}))
    options = ("--template", "study-square", "--seeds", "2", "--workers", "1")
    outputs = ("--report", str(report), "--csv", str(csv))
    code, out, err = touchline("sweep", str(scenario), *options, *outputs, "--set", "follower=mpc,pure-pursuit")
    assert code == 0, err
    assert "lateral error p95, mm" in out
    assert "4 of 4 runs" in out
    swept = json.loads(report.read_text())
    assert [run["seed"] for run in swept["runs"]] == [3, 4, 3, 4]
    single = simulation_of("study-square", "--scenario", str(scenario), "--json")
    assert swept["runs"][0]["scenario_hash"] == single["hash"]["scenario"]
    assert swept["runs"][0]["coverage_pct"] == single["paint"]["coverage_pct"]
    assert len(csv.read_text().splitlines()) == 5
    code, _, err = touchline("sweep", "no-such-thing")
    assert code == 2
    assert "study-square" in err


def test_a_sweep_of_a_team_with_places_has_as_many_robots_as_those(touchline, tmp_path):
    team = tmp_path / "team.json"
    places = {name: {"x_m": x, "y_m": 1.0, "heading_rad": 0.0} for name, x in (("a", 1.0), ("b", 3.0))}
    goals = {"a": [[1.2, 1.0]], "b": [[9.0, 9.0]]}  # b is not there in time
    area = {"outline": [[0, 0], [10, 0], [10, 10], [0, 10]]}
    team.write_text(
        json.dumps({"places": places, "area": area, "task": {"kind": "goals", "goals": goals}, "duration_s": 3.0})
    )
    code, out, err = touchline("fleet", "sweep", "--team", str(team), "--seeds", "1", "--workers", "1", "--json")
    swept = json.loads(out)
    assert swept["combinations"][0]["set"] == {"robots": 2}
    assert (code, swept["complete"]) == (1, True), err
    code, _, err = touchline("fleet", "sweep", "--team", str(team), "--robots", "3")
    assert code == 2 and "has places of 2; give one of them" in err


def swept_until(touchline, monkeypatch, end, seeds, workers):
    """Exit code, figures and failed runs of a sweep in which something ends as soon as one run is done."""

    def advance(_done, doing):
        if doing == f"1 of {seeds}":
            end()

    monkeypatch.setattr(sweep_command, "progress_bar", lambda _title: nullcontext(advance))
    options = ("--set", "follower=pure-pursuit", "--seeds", str(seeds), "--workers", str(workers))
    code, out, _ = touchline("sweep", "study-square", *options, "--json")
    swept = json.loads(out)
    assert 0 < len(swept["runs"]) == swept["combinations"][0]["runs"]
    return code, swept, [run for run in swept["runs"] if not run["success"]]


def test_an_interrupted_sweep_gives_what_is_done(touchline, monkeypatch):
    code, swept, failed = swept_until(touchline, monkeypatch, lambda: signal.raise_signal(signal.SIGINT), 300, 1)
    assert (code, swept["complete"], failed) == (130, False, [])
    assert len(swept["runs"]) < 300


@pytest.mark.full
def test_a_sweep_of_which_all_workers_are_killed_does_the_rest(touchline, monkeypatch):
    """In other processes; `tests/sweep` kills workers of smaller tasks."""

    def kill():
        for worker in multiprocessing.active_children():  # one has its second task, one its first or none yet
            os.kill(worker.pid, signal.SIGKILL)

    code, swept, failed = swept_until(touchline, monkeypatch, kill, 6, 2)
    assert (code, swept["complete"]) == (1, True)
    assert 1 <= sum("was killed (SIGKILL)" in run["reason"] for run in failed) <= 2


@pytest.mark.parametrize(
    ("options", "coverage_pct", "p95_m"),
    [(("--noise", "none", "--follower", "mpc"), 99.8, 0.003), (("--follower", "pure-pursuit"), 98.0, 0.02)],
    ids=["without noise", "with noise"],
)
def test_a_court_is_painted_to_the_millimetre_or_with_noise_to_two_centimetres(
    simulation_of, options, coverage_pct, p95_m
):
    """The same session has the same hash there (tests/system/test_many_robots.py)."""
    paint = simulation_of("tennis", "--json", *options)["paint"]
    assert paint["coverage_pct"] >= coverage_pct
    assert paint["lateral_error_m"]["p95"] <= p95_m
