"""A line marker that meets a person on an area: what it leaves out is told in metres of swaths."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
import shapely

from tests.way_round.met import MARKER, PERSON, meeting
from tests.way_round.run_in_one_process import run_in_one_process
from touchline.bus import BusConfig
from touchline.checking.check_files import check_file
from touchline.jobs.single.simulation import Job, Products
from touchline.jobs.way_round.drives_report import PaintedDrives
from touchline.jobs.way_round.way_round_simulation import WayRoundOutcome, simulate_job
from touchline.jobs.way_round.work_done import draw_work_done
from touchline.schemas.messages import PlanOptions
from touchline.schemas.template import Template
from touchline.services.robot_sim.emulator import Emulator

pytestmark = pytest.mark.xdist_group("painted area")  # by one worker, so that the job is planned and done once

BED = Template.model_validate(
    {
        "name": "bed",
        "segments": [{"id": "edge", "line": {"start": [0, 4], "end": [12, 4]}}],
        "areas": [{"id": "bed", "outline": [[0, 0], [12, 0], [12, 0.36], [0, 0.36]], "angle_deg": 0}],
    }
)
BESIDE = {**PERSON, "y_m": -0.5}


@cache
def job() -> Job:
    return Job.prepare(BED, PlanOptions(), MARKER)


@pytest.fixture(scope="module")
def stood() -> WayRoundOutcome:
    """The job with a person who stands beside the area for good."""
    return done()


def done(record: Path | None = None) -> WayRoundOutcome:
    setup, products = meeting(BESIDE), Products(record=record, strokes=True)
    outcome = simulate_job(job(), Emulator(setup.vehicle, setup.scenario, setup.onboard), products)
    assert isinstance(outcome, WayRoundOutcome)
    return outcome


def test_the_gaps_of_swaths_are_those_of_the_paint(stood: WayRoundOutcome) -> None:
    work, figures = stood.work, stood.figures(job())
    assert isinstance(work, PaintedDrives)
    assert figures["success"] and figures["drives"][0].startswith("goes round "), figures["reason"]
    assert work.gaps and all(gap.line_id.startswith("bed#") and gap.outline for gap in work.gaps)
    assert {segment.id.split("#")[0] for segment in work.template.segments} == {"bed", "edge"}
    paint = shapely.MultiLineString([np.column_stack((each.x_m, each.y_m)) for each in stood.strokes])
    for segment in work.template.segments:
        curve, gaps = segment.curve(), [gap for gap in work.gaps if gap.line_id == segment.id]
        along = np.arange(0.05, curve.length_m - 0.05, 0.01)
        x, y, _, _ = curve.at(along)
        painted = shapely.distance(shapely.points(x, y), paint) < 0.03
        for at_m, there in zip(along, painted, strict=True):
            assert there or any(gap.from_m - 0.05 < at_m < gap.to_m + 0.05 for gap in gaps), (segment.id, at_m)
            assert not there or all(not gap.from_m + 0.05 < at_m < gap.to_m - 0.05 for gap in gaps), (segment.id, at_m)


@pytest.mark.full  # recordings of lines and of a covered area are run again in every run
def test_a_recording_of_it_can_be_run_again(tmp_path: Path) -> None:
    recording = done(tmp_path / "round.mcap").last.recording
    assert recording is not None
    (verdict,) = check_file("", Path(recording["path"]))
    assert verdict.passed, verdict


def test_a_picture_of_it(stood: WayRoundOutcome, tmp_path: Path) -> None:
    draw_work_done(stood.work, stood.strokes, tmp_path / "round.svg")
    assert (tmp_path / "round.svg").read_text().count('id="gap"') == len(stood.figures(job())["gaps"]["stretches"])


@pytest.mark.full  # the area that is covered goes over the bus in every run
def test_over_the_bus_it_leaves_out_the_same(stood: WayRoundOutcome, bus_config: BusConfig) -> None:
    run, figures, _ = run_in_one_process(BED, PlanOptions(), meeting(BESIDE), bus_config)
    here = stood.figures(job())
    assert figures["success"] and len(figures["drives"]) > 1, figures["reason"]
    assert {each.line_id for each in run.work.gaps} == {each.line_id for each in stood.work.gaps}
    assert figures["gaps"]["total_m"] == pytest.approx(here["gaps"]["total_m"], abs=1.0)
    assert figures["paint"]["coverage_pct"] == pytest.approx(here["paint"]["coverage_pct"], abs=0.2)
