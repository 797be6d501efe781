"""Whole jobs with real processes over real Zenoh."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.system.commands import figures, touchline
from touchline.services.bridge.compare import compare
from touchline.services.bridge.reader import RecordingReader
from touchline.services.bus import Bus

SQUARE = ("run", "study-square", "--json")

one_square = pytest.mark.xdist_group("square")  # in one worker, so that it is painted once


@pytest.fixture(scope="module")
def square(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict, Path]:
    """The square, painted as fast as it goes with seed 7."""
    recording = tmp_path_factory.mktemp("square") / "square.mcap"
    return figures(touchline(*SQUARE, "--seed", "7", "--record", str(recording))), recording


@one_square
def test_the_report_has_every_figure(square):
    report, _ = square
    assert report["success"]
    assert set(report["plan"]) >= {"length_m", "time_s", "segments", "max", "continuity", "planning_time_s"}
    assert report["plan"]["length_m"]["paint"] == pytest.approx(4.0)
    assert report["plan"]["segments"] == {"painted": 4, "transitions": 3}
    assert report["traversal"]["total_time_s"] > report["plan"]["time_s"]["total"] * 0.9
    assert report["paint"]["coverage_pct"] > 98.0
    assert report["paint"]["lateral_error_m"]["p95"] < 0.02
    assert report["estimator"]["position_rmse_m"] < 0.03
    assert report["bus"]["lost"] == 0
    assert report["recording"]["complete"]
    assert report["recording"]["lost"] == 0


@one_square
def test_everything_that_was_said_is_in_the_recording(square):
    report, recording = square
    counts: dict[str, int] = {}
    for message in RecordingReader(recording).messages():
        counts[message.topic] = counts.get(message.topic, 0) + 1
    assert sum(counts.values()) == report["recording"]["messages"]
    ticks = counts["/tt2/imu/data_raw"]
    assert ticks == counts["/tt2/joint_states"] == counts["/tt2/cmd/actuators"]
    assert counts["/tt2/odometry/filtered"] == ticks // 2
    assert counts["/tt2/traversal/report"] == counts["/tt2/plan"] == counts["/tt2/template"] == 1
    assert counts["/tt2/gnss/fix"] == pytest.approx(ticks / 10, abs=2)


@one_square
def test_another_pace_gives_the_same_bits(square, tmp_path):
    _, first = square
    paced = tmp_path / "paced.mcap"
    report = figures(touchline(*SQUARE, "--seed", "7", "--speed", "8", "--record", str(paced)))
    assert 4.0 < report["traversal"]["real_time_factor"] < 8.2  # lags of a busy machine are not caught up with
    comparison = compare(first, paced)
    assert comparison.identical, "\n".join(comparison.lines())


@pytest.mark.parametrize("follower", ["mpc"])
def test_without_noise_a_court_is_painted_to_the_millimetre(follower):
    report = figures(touchline("run", "tennis", "--noise", "none", "--follower", follower, "--json"))
    assert report["success"]
    assert report["paint"]["coverage_pct"] >= 99.8
    assert report["paint"]["lateral_error_m"]["p95"] <= 0.003
    assert report["bus"]["lost"] == 0


def test_with_noise_a_court_is_painted_to_two_centimetres(tmp_path):
    """By pure pursuit; the demo does so by MPC (test_cli.py)."""
    recording = tmp_path / "pitch.mcap"
    options = ("--seed", "3", "--follower", "pure-pursuit", "--record", str(recording), "--json")
    report = figures(touchline("run", "tennis", *options))
    assert report["success"]
    assert report["paint"]["coverage_pct"] >= 99.0
    assert report["paint"]["lateral_error_m"]["p95"] <= 0.02
    assert report["bus"]["lost"] == report["recording"]["lost"] == 0


def test_a_follower_from_outside_steers_as_the_example_says(bus_config, tmp_path):
    field = tmp_path / "line.json"
    field.write_text('{"name": "line", "segments": [{"id": "a", "line": {"start": [0, 0], "end": [1, 0]}}]}')
    example = Path(__file__).parents[2] / "examples" / "external_follower.py"
    environment = {**os.environ, **bus_config.environment()}
    with subprocess.Popen([sys.executable, str(example)], env=environment) as follower:
        try:
            with Bus.open("bystander", bus_config) as bus:
                assert not bus.wait_for({"follower"}, 100.0)
            report = figures(touchline("run", str(field), "--json", "--follower", "external", config=bus_config))
        finally:
            follower.terminate()
    assert report["success"]
    assert report["traversal"]["follower_fallbacks"] == 0
