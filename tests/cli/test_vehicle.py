"""A robot of one's own: what is wrong with its file, and that plans, drives and hashes are its own."""

import json
from pathlib import Path

import numpy as np
import pytest

from touchline.schemas.catalogue import load_template
from touchline.schemas.messages import PlanOptions
from touchline.schemas.scenario import Scenario
from touchline.schemas.spec import parse, read_text
from touchline.schemas.vehicles import DifferentialDrive, SprayerTool, Vehicle
from touchline.services.planner.plan import plan
from touchline.services.planner.plots.actuator_series import actuator_series
from touchline.services.robot_sim.emulator import Emulator

EXAMPLE = Path(__file__).parents[2] / "examples" / "small-robot.json"


@pytest.mark.parametrize(
    ("fields", "says"),
    [
        ({"track_m": 0.4}, "own.json: track_m is not a known field; remove it or mend its name"),
        ({"drive": {"track_m": 0.4}}, "own.json: drive.track_m is not a known field; did you mean 'track_width_m'?"),
        (
            {"drive": {"wheel_radius_m": 100}},
            "own.json: drive.wheel_radius_m is 100; give at most 2 m (in metres, not cm or mm)",
        ),
        ({"wheel_radius_m": 100}, "own.json: drive.wheel_radius_m is 100; give at most 2 m (in metres, not cm or mm)"),
        ({"tool": {"paint_l_per_m": -1}}, "own.json: tool.paint_l_per_m is -1; give more than 0 l per m"),
        (
            {"drive": {"motor": {"max_current_a": -2}}},
            "own.json: drive.motor.max_current_a is -2; give at least 0.01 A",
        ),
        ({"tool": {"tank_l": "full"}}, "own.json: tool.tank_l is 'full'; give a number"),
        ({"body": {"footprint_m": [[0, 0], [1, 1]]}}, "own.json: body.footprint_m has 2 items; give at least 3"),
        ({"drive": {"kind": "tricycle"}}, "own.json: drive.kind is 'tricycle'; give 'differential' or 'rear-steered'"),
        (
            {"drive": {"kind": ["differential"]}},
            "own.json: drive.kind is not allowed; give 'differential' or 'rear-steered'",
        ),
        ({"tool": {"kind": "mower"}}, "own.json: tool.kind is 'mower'; give 'sprayer', 'none' or 'roller'"),
        ({"kinematics": "tricycle"}, "own.json: drive.kind is 'tricycle'; give 'differential' or 'rear-steered'"),
        ({"drive": 3}, "own.json: drive is a JSON number; give an object"),
        (
            {"drive": {}, "tank_l": 3},
            "own.json: tank_l is 3; give it as tool.tank_l, where body, drive and tool are apart",
        ),
        (
            {"body": {"mass_empty_kg": 120}},
            "own.json: tool.mass_full_kg is 100.0; give at least 120 kg, the mass_empty_kg",
        ),
        (
            {"drive": {"wheel_radius_m": 0.06}},
            "own.json: drive.transit_speed_mps is 1.4; give at most 1.2 m/s: the wheels do no more",
        ),
        (
            {"drive": {"wheel_radius_m": 0.04, "transit_speed_mps": 0.7}},
            "own.json: tool.paint_speed_mps is 1.0; give at most 0.8 m/s: the wheels do no more",
        ),
        ({"drive": {"track_width_m": 4}}, "plan has kappa_max_1pm = 1.125; give 0.01 to 0.5 1/m, or give the vehicle"),
    ],
)
def test_what_is_wrong_with_a_vehicle_is_told_in_one_line(fields, says, touchline, tmp_path, monkeypatch):
    monkeypatch.setenv("COLUMNS", "300")
    path = tmp_path / "own.json"
    path.write_text(json.dumps(fields))
    code, out, err = touchline("plan", "study-square", "--method", "ccd", "--vehicle", str(path))
    assert (code, out) == (2, "")
    assert says in err
    assert len(err.strip().splitlines()) == 1


@pytest.mark.parametrize("command", ["plan X", "simulate X", "sweep X", "run X", "up", "demo", "planner", "robot-sim"])
def test_every_command_that_has_a_robot_takes_another(command, touchline, tmp_path):
    path = tmp_path / "own.json"
    path.write_text('{"wheels": 3}')
    code, _, err = touchline(*command.replace("X", "study-square").split(), "--vehicle", str(path))
    assert code == 2
    assert "own.json: wheels is not a known field" in " ".join(err.split())


def test_the_example_is_planned_within_its_own_limits(touchline):
    small, template = parse(Vehicle, read_text(EXAMPLE), EXAMPLE.name), load_template("study-square")
    planned = plan(template, small, PlanOptions())
    series = actuator_series(planned, 0.01)
    assert np.abs(series.value).max() <= small.drive.max_wheel_speed_radps
    assert max(each.max_rate for each in planned.report.actuators) <= small.drive.planned_wheel_acceleration_radps2
    told, usual = (
        json.loads(touchline("plan", "study-square", "--json", *arguments)[1])
        for arguments in (("--vehicle", str(EXAMPLE)), ())
    )
    assert [each["max"] for each in told["actuators"].values()] == [each.max for each in planned.report.actuators]
    assert told["time_s"]["total"] > usual["time_s"]["total"]


def test_the_example_drives_with_its_own_track():
    small = parse(Vehicle, read_text(EXAMPLE), EXAMPLE.name)
    emulator = Emulator(small, Scenario(noise="none"))
    emulator.load(plan(load_template("study-square"), small, PlanOptions()).trajectory)
    emulator.start()
    rates, yaw = [], []
    while emulator.active:
        emulator.tick()
        rates.append(emulator.world.drive.rate_radps.copy())
        yaw.append(emulator.world.state.yaw_rate_radps)
    left, right = np.array(rates).T
    turning = np.abs(yaw) > 0.5
    track_m = (right - left)[turning] * small.drive.wheel_radius_m / np.array(yaw)[turning]
    assert np.median(track_m) == pytest.approx(small.drive.track_width_m, rel=0.05)
    assert max(np.abs(left).max(), np.abs(right).max()) <= small.drive.max_wheel_speed_radps


@pytest.mark.parametrize("command", ["plan", pytest.param("simulate", marks=pytest.mark.full)])
def test_a_tank_and_a_battery_that_will_not_last_are_told_before(command, touchline, tmp_path, monkeypatch):
    monkeypatch.setenv("COLUMNS", "300")
    path = tmp_path / "own.json"
    path.write_text(json.dumps({"tool": {"tank_l": 0.05}, "body": {"battery_wh": 0.6}}))
    arguments = (command, "study-square", "--json")
    _, _, told = touchline(*arguments, "--vehicle", str(path))
    assert "the job needs 0.031 L of paint, the tank has 0.05 L: refill it once" in told
    assert "Wh, the battery has 0.6 Wh, of which it keeps 0.048 Wh: change it once" in told
    assert "the job needs" not in touchline(*arguments)[2]


def test_another_vehicle_is_another_cause(touchline):
    small, usual = (
        json.loads(touchline("simulate", "study-square", "--json", *arguments)[1])
        for arguments in (("--vehicle", str(EXAMPLE)), ())
    )
    assert small["hash"]["scenario"] != usual["hash"]["scenario"]
    assert (small["vehicle"], usual["vehicle"]) == ("small-robot", "turf-tank-two")
    assert small["success"]


def test_a_sweep_runs_with_one_vehicle(touchline):
    arguments = ("study-square", "--vehicle", str(EXAMPLE), "--json")
    swept = json.loads(touchline("sweep", *arguments, "--seeds", "1", "--workers", "1")[1])
    alone = json.loads(touchline("simulate", *arguments, "--seed", "1")[1])
    assert swept["runs"][0]["scenario_hash"] == alone["hash"]["scenario"]


def test_the_shipped_robot_is_printed_as_a_file_that_can_be_given(touchline):
    code, out, _ = touchline("vehicle")
    assert code == 0
    assert set(json.loads(out)) == set(Vehicle.model_fields)
    assert set(json.loads(out)["drive"]) == set(DifferentialDrive.model_fields)
    assert set(json.loads(out)["tool"]) == set(SprayerTool.model_fields)
    assert parse(Vehicle, out, "printed") == Vehicle()
