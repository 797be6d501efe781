"""A whole job with a person on one of its lines, by planner, robot and bridge as processes of their own."""

import json
from pathlib import Path

import pytest

from tests.system.commands import figures, touchline_here
from tests.way_round.met import FIELD, IN_YARD, LIDAR, PERSON, SWEEPER, YARD
from touchline.checking.check_files import check_file


@pytest.mark.full
def test_the_robot_goes_round_a_person_and_the_run_reports_all_its_drives(tmp_path: Path) -> None:
    template, vehicle, world = tmp_path / "lines.json", tmp_path / "marker.json", tmp_path / "world.json"
    template.write_text(FIELD.to_json())
    vehicle.write_text(json.dumps({"name": "marker", "sensors": [LIDAR]}))
    world.write_text(json.dumps({"seed": 5, "objects": [PERSON]}))
    record, plot = tmp_path / "round.mcap", tmp_path / "round.svg"
    files = ("--record", str(record), "--plot", str(plot))
    done = touchline_here("run", str(template), "--vehicle", str(vehicle), "--scenario", str(world), *files, "--json")
    told = figures(done)
    assert told["success"] and told["recording"]["complete"], told["reason"]
    assert len(told["drives"]) > 2 and told["drives"][0].startswith("goes round ")
    (gap,) = told["gaps"]["stretches"]
    assert gap["line"] == "s0" and gap["along_m"][0] < 6.0 < gap["along_m"][1]
    assert told["gaps"]["total_m"] < 5.0 and f'left out beside "{gap["reason"]}"' in done.stderr
    assert told["paint"]["coverage_pct"] > 99.0 and 'id="gap"' in plot.read_text()
    (verdict,) = check_file("", record)
    assert verdict.passed, verdict


@pytest.mark.full
def test_a_roller_covers_an_area_round_a_person_and_the_run_reports_the_patches(tmp_path: Path) -> None:
    template, vehicle, world = tmp_path / "yard.json", tmp_path / "sweeper.json", tmp_path / "world.json"
    template.write_text(YARD.to_json())
    vehicle.write_text(SWEEPER.model_dump_json())
    world.write_text(json.dumps({"seed": 6, "objects": [IN_YARD]}))
    record, plot = tmp_path / "round.mcap", tmp_path / "round.svg"
    files = ("--record", str(record), "--plot", str(plot))
    quick = ("--coverage", "90", "--laps", "1", "--swath-angle", "0")
    inputs = (str(template), "--vehicle", str(vehicle), "--scenario", str(world), *quick)
    done = touchline_here("run", *inputs, *files, "--json")
    told, here = figures(done), figures(touchline_here("simulate", *inputs, "--json"))
    assert told["success"] and told["recording"]["complete"], told["reason"]
    assert told["drives"][0].startswith("goes round ") and 'id="uncovered"' in plot.read_text()
    patch = next(each for each in told["uncovered"]["patches"] if each["reason"] != "plan")
    assert f'left out beside "{patch["reason"]}"' in done.stderr
    assert told["uncovered"]["left_out_m2"] == pytest.approx(here["uncovered"]["left_out_m2"], abs=1.0)
    assert told["area"]["covered_m2"] == pytest.approx(here["area"]["covered_m2"], abs=1.0)
    (verdict,) = check_file("", record)
    assert verdict.passed, verdict
