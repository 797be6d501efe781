"""A drive that is registered is planned with and stands in the help, and no file but its own knows it."""

import json
import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.command import app
from tests.planner.drum_drive import DrumDrive, registered
from tests.with_full import with_full
from touchline.jobs.single.simulation import Job, simulate
from touchline.schemas.catalogue import load_template
from touchline.schemas.cdr import encode
from touchline.schemas.errors import SpecError
from touchline.schemas.messages import PlanOptions
from touchline.schemas.scenario import Scenario
from touchline.schemas.spec import parse
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.plan import Plan, plan
from touchline.services.planner.plots.actuator_picture import plot_actuators
from touchline.services.planner.plots.actuator_series import actuator_series

pytestmark = pytest.mark.xdist_group("drum")  # its kernels are compiled in one worker
OWN = '{"name": "roller", "drive": {"kind": "drum", "transit_speed_mps": 1.2}}'
GIVEN = PlanOptions(order="given")


@pytest.fixture(autouse=True)
def drum() -> Iterator[None]:
    with registered():
        yield


def of_roller(name: str = "tennis", **options: object) -> tuple[Plan, Vehicle]:
    """In the given order: what an order is found with takes three times as long to compile as all else."""
    vehicle = parse(Vehicle, OWN, "own.json")
    return plan(load_template(name), vehicle, PlanOptions.model_validate({"order": "given"} | options)), vehicle


@pytest.mark.parametrize(
    "options", with_full({}, full=({"method": "ccd"}, {"forward_only": True}, {"order": "optimised"}))
)
def test_it_plans_within_its_own_limits_and_is_drawn(options: dict[str, object], tmp_path: Path) -> None:
    planned, vehicle = of_roller(**options)
    drive, report = vehicle.drive, planned.report
    assert isinstance(drive, DrumDrive)
    assert report.painted_segments == 11
    assert report.spins == 0
    assert (report.cusps > 0) == (not options or "order" in options)
    assert report.max_curvature_1pm <= math.tan(drive.max_steering_rad) / drive.wheelbase_m * (1 + 1e-9)
    series = actuator_series(planned, 0.005)
    assert series.violations(vehicle) == 0
    drum, steering = np.abs(series.value).max(axis=1)
    assert drum == pytest.approx(1.2 / drive.drum_radius_m)
    assert 0.4 * drive.max_steering_rad < steering <= drive.max_steering_rad
    assert np.abs(series.rate[1]).max() > 0.5 * drive.max_steering_rate_radps
    assert [(each.name, each.unit) for each in report.actuators] == [("drum", "rad/s"), ("steering", "rad")]
    assert [each.max for each in report.actuators] == pytest.approx([drum, steering], rel=1e-3)
    assert report.actuators[1].max_rate <= drive.max_steering_rate_radps * (1 + 1e-6)
    assert 0.0 < report.battery_wh < 100.0
    plot_actuators(planned, load_template("tennis"), vehicle, tmp_path / "own.svg")
    text = (tmp_path / "own.svg").read_text()
    for words in ("drum wheel", "steering steering", "steering rate (rad/s)", "wheel acceleration (rad/s²)"):
        assert words in text


def test_the_shipped_drive_plans_the_same_beside_it() -> None:
    template = load_template("study-square")
    before = encode(plan(template, Vehicle()).trajectory)
    of_roller()
    assert encode(plan(template, Vehicle()).trajectory) == before


def test_it_is_in_the_help_and_printed_as_a_file_that_can_be_given(tmp_path: Path) -> None:
    runner = CliRunner()
    helped = " ".join(runner.invoke(app, ["vehicle", "--help"]).output.replace("│", " ").split())
    assert "drum: a driven drum and a steered wheel" in helped
    printed = runner.invoke(app, ["vehicle", "--drive", "drum"]).output
    assert json.loads(printed)["drive"] == DrumDrive().model_dump()
    path = tmp_path / "own.json"
    path.write_text(printed)
    planned = json.loads(
        runner.invoke(app, ["plan", "study-square", "--order", "given", "--json", "--vehicle", str(path)]).output
    )
    assert planned["actuators"]["drum"]["max"] <= DrumDrive().max_drum_speed_radps


def test_its_figures_are_its_own() -> None:
    with pytest.raises(SpecError, match=r"own.json: drive.track_width_m is not a known field"):
        parse(Vehicle, '{"drive": {"kind": "drum", "track_width_m": 0.4}}', "own.json")
    with pytest.raises(
        SpecError, match=r"own.json: drive.kind is 'tricycle'; give 'differential', 'rear-steered' or 'drum'"
    ):
        parse(Vehicle, '{"drive": {"kind": "tricycle"}}', "own.json")
    with pytest.raises(SpecError, match=r"tool.paint_speed_mps is 1.0; give at most 0.8 m/s: the drive does no more"):
        parse(
            Vehicle,
            '{"drive": {"kind": "drum", "drum_radius_m": 0.2, "transit_speed_mps": 0.5}}',
            "own.json",
        )


def test_a_kind_that_cannot_be_emulated_is_told_in_a_line() -> None:
    job = Job.prepare(load_template("study-square"), GIVEN, parse(Vehicle, OWN, "own.json"))
    with pytest.raises(SpecError) as told:
        simulate(job, Scenario())
    assert str(told.value) == (
        "vehicle: drive.kind is 'drum', which has nothing for the world; "
        "give one that has (differential, rear-steered), or register its part `world` in `KindParts`"
    )
