"""A vehicle without a tool is planned along lines: nothing is switched, nothing runs out and nothing dries."""

import json

import pytest
from typer.testing import CliRunner

from tests.command import app
from touchline.schemas import supplies
from touchline.schemas.catalogue import load_template
from touchline.schemas.errors import PlanningError, SpecError
from touchline.schemas.messages import PlanOptions
from touchline.schemas.spec import parse
from touchline.schemas.vehicles import NoTool, Vehicle
from touchline.services.planner.plan import plan

BARE = Vehicle(tool=NoTool(point_y_m=-0.41124))
TENNIS = load_template("tennis")


def test_it_drives_the_sprayers_way_and_switches_nothing() -> None:
    sprayed, bare = plan(TENNIS, Vehicle()), plan(TENNIS, BARE)
    switches = bare.trajectory.actuation_profile.parameters
    assert [each.actuation.value for each in switches] == [0]
    assert len(sprayed.trajectory.actuation_profile.parameters) > 20
    assert {line.segment_id for line in bare.painted} == {line.segment_id for line in sprayed.painted}
    assert bare.report.paint_length_m == pytest.approx(sprayed.report.paint_length_m)


def test_it_goes_along_lines_at_its_own_speed() -> None:
    slow = BARE.changed(tool={"line_speed_mps": 0.5})
    planned = plan(TENNIS, slow)
    assert planned.report.paint_time_s == pytest.approx(planned.report.paint_length_m / 0.5, rel=1e-3)


def test_nothing_runs_out_and_nothing_dries() -> None:
    report = plan(TENNIS, BARE, PlanOptions(drying_time_s=900.0, hard_drying=True)).report
    assert (report.paint_l, report.wet_crossings, report.wet_crossings_unavoidable) == (0.0, 0, 0)
    needs = supplies.full(report, BARE)
    assert needs.paint.needed is None and needs.paint.lasts and needs.paint.refills == 0
    with pytest.raises(PlanningError, match="drying_time_s"):
        plan(TENNIS, BARE, PlanOptions(drying_time_s=-1.0))


def test_its_battery_goes_by_its_mass() -> None:
    heavy = BARE.changed(body={"mass_empty_kg": 2.0 * BARE.body.mass_empty_kg})
    light_wh, heavy_wh = (plan(TENNIS, each).report.battery_wh for each in (BARE, heavy))
    assert 1.2 * light_wh < heavy_wh < 2.0 * light_wh


def test_it_is_a_file_that_can_be_given(tmp_path) -> None:
    runner = CliRunner()
    printed = runner.invoke(app, ["vehicle", "--tool", "none"]).output
    assert json.loads(printed)["tool"] == NoTool().model_dump()
    path = tmp_path / "bare.json"
    path.write_text(printed)
    planned = json.loads(runner.invoke(app, ["plan", "study-square", "--json", "--vehicle", str(path)]).output)
    assert planned["estimate"]["paint_l"] == 0.0
    with pytest.raises(SpecError, match=r"bare.json: tool.line_speed_mps is 3.0; give at most 2 m/s"):
        parse(Vehicle, '{"tool": {"kind": "none", "line_speed_mps": 3.0}}', "bare.json")
