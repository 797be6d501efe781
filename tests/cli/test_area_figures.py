"""Products of a session of a tool that covers areas: figures, a recording, pictures, columns of a sweep."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from tests.command import app
from tests.painted import read_painted
from tests.robot_sim.test_area_session import CONFIG, PAN
from touchline.jobs.single.covered_picture import COVERED, MISSED, TWICE
from touchline.jobs.single.simulation import Job, Products, simulate
from touchline.jobs.single.work_picture import draw_unfinished
from touchline.jobs.sweep.task import run_figures
from touchline.schemas.messages import PlanOptions
from touchline.schemas.scenario import Scenario
from touchline.schemas.template import Polygon
from touchline.schemas.vehicles.shipped import CLAY_ROLLER

pytestmark = pytest.mark.xdist_group("area figures")  # by one worker, so that it is recorded once
CLAY = Scenario(seed=2, ground={"surface": "clay"})


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """The job, what came of it, and its recording."""
    path = tmp_path_factory.mktemp("pan") / "pan.mcap"
    job = Job.prepare(PAN, PlanOptions(order="given", area_method="parallel"), CLAY_ROLLER)
    return job, simulate(job, CLAY, CONFIG, Products(record=path, strokes=True)), path


def test_the_report_has_the_areas_in_place_of_paint(recorded):
    job, outcome, _ = recorded
    figures = outcome.figures(job)
    assert figures["success"] and "paint" not in figures and "segments" not in figures
    area = figures["area"]
    assert area["coverage_pct"] > 99.5 and area["accepted"]
    assert area["patches"] == len(area["missed"])
    assert area["lateral_error_m"]["p95"] == outcome.report.lateral_error_p95_m > 0.0


def test_a_sweep_has_columns_of_the_areas(recorded):
    figures = run_figures(recorded[1].report, recorded[1].area)
    assert list(figures)[:6] == [
        "of_field_pct",
        "of_reachable_pct",
        "of_planned_pct",
        "missed_m2",
        "overlap_m2",
        "body_outside_m",
    ]
    assert {"lateral_error_p95_m", "total_time_s"} < set(figures)
    assert not set(figures) & {"overspray_m2", "gap_m", "coverage_pct"}
    assert "overspray_m2" in run_figures(recorded[1].report)


def test_the_picture_of_a_recording_shows_ground(recorded, tmp_path):
    _, outcome, path = recorded
    out = tmp_path / "pan.svg"
    done = CliRunner().invoke(app, ["picture", str(path), "--out", str(out)])
    assert done.exit_code == 0, done.output
    drawing = out.read_text(encoding="utf-8")
    for part in ("covered", "twice", "missed"):
        assert f'id="{part}"' in drawing
    session = read_painted(path)
    assert session.covers and session.area == outcome.area
    assert sum(len(stroke.x_m) for stroke in session.strokes) == sum(len(s.x_m) for s in outcome.strokes)


def test_gaps_and_obstacles_stand_out(recorded, tmp_path: Path):
    half = [
        stroke.model_copy(update={"x_m": stroke.x_m[:900], "y_m": stroke.y_m[:900]}) for stroke in recorded[1].strokes
    ]
    pond = Polygon(id="pond", corners=((3.0, 3.0), (4.0, 3.0), (4.0, 4.0)))
    out = tmp_path / "half.svg"
    draw_unfinished(PAN.model_copy(update={"obstacles": (pond,)}), half[:1], out, covers=True)
    drawing = out.read_text(encoding="utf-8")
    assert {COVERED, MISSED} <= {colour for colour in (COVERED, MISSED, TWICE) if f"fill: {colour}" in drawing}
    assert 'id="obstacles"' in drawing and "not finished" not in drawing[:200]
