"""In one process: the bits of the whole system, without it."""

import json

import pytest

from services.bridge.compare import compare
from tests.system.commands import figures, touchline

SQUARE = ("study-square", "--json", "--seed", "7")
WALL_CLOCK = ("wall_time_s", "real_time_factor")


@pytest.fixture(scope="module")
def over_zenoh(tmp_path_factory):
    recording = tmp_path_factory.mktemp("run") / "run.mcap"
    return figures(touchline("run", *SQUARE, "--record", str(recording))), recording


def test_a_simulation_says_byte_for_byte_what_a_run_says(over_zenoh, tmp_path):
    run, recorded = over_zenoh
    recording = tmp_path / "simulation.mcap"
    simulation = figures(touchline("simulate", *SQUARE, "--record", str(recording)))
    assert simulation["hash"] == run["hash"]
    assert len(run["hash"]["session"]) == len(run["hash"]["scenario"]) == 16
    comparison = compare(recorded, recording)
    assert comparison.identical, "\n".join(comparison.lines())


def test_the_figures_are_the_same_with_and_without_telemetry(over_zenoh):
    run, _ = over_zenoh
    simulation = figures(touchline("simulate", *SQUARE))
    assert simulation["hash"] == {"scenario": run["hash"]["scenario"], "session": None}
    for part in ("paint", "segments", "estimator"):
        assert simulation[part] == run[part]
    for report in (run, simulation):
        for name in WALL_CLOCK:
            del report["traversal"][name]
    assert simulation["traversal"] == run["traversal"]


def test_not_recorded_is_the_same_session(over_zenoh):
    run, _ = over_zenoh
    assert figures(touchline("run", *SQUARE))["hash"] == run["hash"]
    assert figures(touchline("simulate", *SQUARE, "--hash"))["hash"] == run["hash"]


def test_a_scenario_file_is_lived_by_both(tmp_path):
    scenario = tmp_path / "calm.json"
    scenario.write_text(json.dumps({"seed": 3, "follower": "pure-pursuit", "gnss": {"white_m": 0.001}}))
    options = ("study-square", "--json", "--scenario", str(scenario))
    run = figures(touchline("run", *options))
    simulation = figures(touchline("simulate", *options, "--hash"))
    assert simulation["hash"] == run["hash"]
    assert (run["seed"], run["follower"]) == (3, "pure-pursuit")
    assert figures(touchline("simulate", *options, "--hash", "--seed", "4"))["hash"] != run["hash"]


def test_a_recording_is_drawn(over_zenoh, tmp_path):
    _, recorded = over_zenoh
    picture = tmp_path / "painted.svg"
    done = touchline("picture", str(recorded), "--out", str(picture))
    assert done.returncode == 0, done.stderr
    drawn = picture.read_text()
    assert "nozzle off the template" in drawn
    assert touchline("picture", str(recorded), "--out", "painted.gif").returncode == 2
    assert touchline("picture", str(picture), "--out", str(picture)).returncode == 2
