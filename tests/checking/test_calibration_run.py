"""Calibration drive of an emulated robot, from the command to the files, and its session."""

import json
from datetime import UTC, datetime
from pathlib import Path

import pytest
from typer.testing import CliRunner

from tests.command import app
from touchline.checking.check_session import check_recording
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.spec import parse

TRUTH = {"gyro_scale_relative": 0.005, "antenna_x_m": 0.01, "antenna_y_m": -0.01, "stamp_offset_s": 0.03}
WANTED = {"gyro scale": 0.005, "antenna forward": 0.01, "antenna left": -0.01, "stamp offset": -0.03}
pytestmark = pytest.mark.xdist_group("checking")


def test_a_robot_finds_out_what_its_files_are_wrong_by(tmp_path):
    scenario, log, out = tmp_path / "scenario.json", tmp_path / "drive.mcap", tmp_path / "robot"
    scenario.write_text(json.dumps({"seed": 4, "truth": TRUTH}))
    options = ["--vehicle", "turf-tank-two", "--scenario", str(scenario), "--record", str(log), "--out", str(out)]
    result = CliRunner().invoke(app, ["calibrate", *options, "--json"])
    assert result.exit_code == 0, result.output
    assert "of free ground" in result.stderr
    said = json.loads(result.stdout)
    for each in said["constants"]:
        if each["name"] in WANTED:
            assert abs(each["found"] - each["in_file"] - WANTED[each["name"]]) < 3.0 * each["sigma"], each
    beside = {each["name"]: each for each in said["beside"]}
    assert beside["nozzle offset"]["found"] is None
    assert abs(beside["accelerometer bias left"]["found"]) < 1.0
    onboard = parse(OnboardConfig, (out / "onboard.json").read_text(), "onboard")
    assert onboard.imu.gyro_scale_sigma < 0.001
    antenna = onboard.calibrated.antenna
    assert antenna is not None
    assert (antenna.day, antenna.log) == (datetime.now(UTC).date(), "drive.mcap")
    (one,) = check_recording(log, exact=True)
    assert one.passed
    assert one.planned == 1


@pytest.mark.parametrize(
    ("options", "refusal"),
    [
        (["--vehicle", "turf-tank-two", "--robot", "tt2"], "--robot is tt2, and --vehicle is given, too"),
        (["--vehicle", "turf-tank-two", "--field", "yard.json"], "of free ground, 0.6 m behind the start"),
        (["--vehicle", "turtlebot2"], "robots with a GNSS receiver"),
        (["square.mcap", "--start", "0,0,0"], "--start is 0,0,0, but a recording is given"),
        (["--scenario", "here.json"], "the robot on the bus has its own"),
    ],
)
def test_what_cannot_be_done_is_refused_before_anything_starts(options, refusal, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    yard = {"id": "yard", "corners": [[-5, -5], [5, -5], [5, 5], [-5, 5]]}
    line = {"id": "line", "line": {"start": [0, 0], "end": [1, 0]}}
    Path("yard.json").write_text(json.dumps({"name": "yard", "boundary": yard, "segments": [line]}))
    result = CliRunner().invoke(app, ["calibrate", *options])
    assert result.exit_code != 0
    assert refusal in " ".join(str(result.exception or result.output).split()) + " ".join(result.stderr.split())
    assert [each.name for each in tmp_path.iterdir()] == ["yard.json"]
