"""Whole jobs with real processes over real Zenoh."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.meeting import eventually
from tests.system.commands import figures, start_touchline, touchline, touchline_here
from touchline.bus import Bus, BusConfig
from touchline.bus.ports import free_port
from touchline.recordings.channels import is_drawn, robots_among
from touchline.recordings.reader import RecordingReader

FLEET = {
    "robots": [
        {"namespace": "tt2", "seed": 7},
        {"namespace": "exact", "scenario": {"noise": "none"}, "onboard": {"follower": "mpc"}},
        {"namespace": "noisy", "seed": 3, "onboard": {"follower": "pure-pursuit"}},
    ]
}

COURT = """{"name": "court", "line_width_m": 0.05, "segments": [
    {"id": "south", "line": {"start": [0, 0], "end": [6, 0]}}, {"id": "east", "line": {"start": [6, 0], "end": [6, 8]}},
    {"id": "north", "line": {"start": [6, 8], "end": [0, 8]}}, {"id": "west", "line": {"start": [0, 8], "end": [0, 0]}},
    {"id": "bow", "arc": {"start": [1, 0], "center": [3, 0], "sweep_angle": -3.141592653589793}}]}"""
"""A small one: a whole tennis court is painted in test_cli.py."""


@pytest.fixture(scope="module")
def robots(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[BusConfig, Path]]:
    """Robots of different noise and followers, up for their jobs; where they are, and the folder of recordings."""
    folder, config = tmp_path_factory.mktemp("robots"), BusConfig(endpoint=f"tcp/127.0.0.1:{free_port()}")
    fleet, log = folder / "robots.json", folder / "up.log"
    fleet.write_text(json.dumps(FLEET))
    (folder / "court.json").write_text(COURT)
    up = start_touchline("up", "--robots", str(fleet), "--recordings", str(folder), config=config, log=log)
    try:
        assert eventually(lambda: "is up" in log.read_text(), 300.0), log.read_text()
        yield config, folder
    finally:
        up.send_signal(signal.SIGTERM)
        assert up.wait(60) == 0


def painted(robots: tuple[BusConfig, Path], robot: str, template: str, *options: str) -> dict[str, Any]:
    """The report of a job done as fast as it goes."""
    return figures(touchline_here("run", template, "--robot", robot, "--json", *options, config=robots[0]))


@pytest.fixture(scope="module")
def square(robots: tuple[BusConfig, Path]) -> tuple[dict[str, Any], Path]:
    """The square, painted with seed 7."""
    recording = robots[1] / "square.mcap"
    return painted(robots, "tt2", "study-square", "--record", str(recording)), recording


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


def test_everything_that_was_said_is_in_the_recording(square):
    report, recording = square
    counts: dict[str, int] = {}
    for message in RecordingReader(recording).messages():
        counts[message.topic] = counts.get(message.topic, 0) + 1
    robots = robots_among(counts)
    counts = {topic: count for topic, count in counts.items() if not is_drawn(topic, robots)}
    assert sum(counts.values()) == report["recording"]["messages"]
    ticks = counts["/tt2/imu/data_raw"]
    assert ticks == counts["/tt2/joint_states"] == counts["/tt2/cmd/actuators"]
    assert counts["/tt2/odometry/filtered"] - ticks // 2 in (1, 2), "and what it knew before it drove"
    assert counts["/tt2/traversal/report"] == counts["/tt2/plan"] == counts["/tt2/template"] == 1
    assert counts["/tt2/gnss/fix"] == pytest.approx(ticks / 10, abs=2)


def test_the_next_job_of_a_robot_has_a_report_of_its_own(robots, square):
    report = painted(robots, "tt2", str(robots[1] / "court.json"))
    assert report["success"]
    assert report["traversal"]["total_time_s"] > report["plan"]["time_s"]["total"] * 0.9
    assert report["hash"]["session"] != square[0]["hash"]["session"]


def test_without_noise_a_court_is_painted_to_the_millimetre(robots):
    court = str(robots[1] / "court.json")
    report = painted(robots, "exact", court)
    simulated = touchline_here("simulate", court, "--noise", "none", "--follower", "mpc", "--json", "--hash")
    assert report["hash"] == figures(simulated)["hash"], "not recorded, it is the same session, too"
    assert report["success"]
    assert report["paint"]["coverage_pct"] >= 99.8
    assert report["paint"]["lateral_error_m"]["p95"] <= 0.003
    assert report["bus"]["lost"] == 0


def test_with_noise_a_court_is_painted_to_two_centimetres(robots):
    """By pure pursuit; the demo does so by MPC (test_cli.py)."""
    recording = str(robots[1] / "court.mcap")
    report = painted(robots, "noisy", str(robots[1] / "court.json"), "--record", recording)
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
