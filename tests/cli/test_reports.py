"""Reports: what they say of a recording that broke off, and that every figure is explained."""

import re
from collections.abc import Mapping
from pathlib import Path

from touchline.bus import CallError
from touchline.bus.counters import Counters
from touchline.jobs.single import reports
from touchline.jobs.single.bus_run import BusRun, JobOptions
from touchline.jobs.way_round.covered_areas import uncovered_figures
from touchline.jobs.way_round.drives_report import gap_figures
from touchline.schemas.messages import (
    AreaReport,
    PlannedCoverage,
    PlanOptions,
    PlanReport,
    PlanResponse,
    SegmentPaint,
    TraversalReport,
    TraversalStatus,
)
from touchline.schemas.vehicles import Vehicle

DOCUMENT = Path(__file__).parents[2] / "docs" / "reference" / "reports.md"


class DeadBus:
    """Nobody answers."""

    node, counters = "operator", Counters()

    def call(self, *arguments):
        raise CallError("nobody answers")


class Deaf:
    """Hears nothing."""

    def event(self, severity, text):
        """Not even that."""

    def check(self):
        """Nor does it look."""


class Listening(Deaf):
    """Remembers what it is told."""

    def __init__(self):
        self.told = []

    def event(self, severity, text):
        self.told.append(text)

    def stage(self, text):
        """It knows."""


class Planner:
    """Answers every request with one plan, and says nothing."""

    def __init__(self, report):
        self.response = PlanResponse(success=True, report=report)

    def call(self, *arguments):
        return self.response

    def inbox(self, *arguments, **options):
        return None


def test_a_job_that_a_full_tank_does_not_last_for_is_told_as_soon_as_it_is_planned():
    watcher = Listening()
    options = JobOptions("{}", PlanOptions(), -1.0, None, vehicle=Vehicle(tool={"tank_l": 10.0}))
    BusRun(Planner(PlanReport(paint_l=29.0, battery_wh=1.0)), options, watcher)._plan()
    assert watcher.told == ["planner: the job needs 29.0 L of paint, the tank has 10.0 L: refill it twice"]


def job_report(recording):
    job = BusRun(DeadBus(), JobOptions("{}", PlanOptions(), -1.0, Path("x.mcap"), "cause"), Deaf())
    plan = PlanResponse(success=True, report=PlanReport())
    job.report = TraversalReport(success=True, total_time_s=2.0)
    return job._report(plan, TraversalStatus(), 1.0, recording)


def test_a_job_without_its_recording_is_no_success_and_says_why():
    whole = {"path": "x.mcap", "complete": True, "messages": 3, "bytes": 5, "lost": 0}
    assert job_report(whole)["success"]
    report = job_report({"path": "x.mcap", "complete": False, "problem": "nothing is being recorded"})
    assert not report["success"]
    assert report["reason"] == "the recording is not complete: nothing is being recorded"


def names(figures, prefix=""):
    for name, value in figures.items():
        if isinstance(value, Mapping):
            yield from names(value, f"{prefix}{name}.")
        elif not isinstance(value, list):
            yield prefix + name


def test_every_figure_is_explained():
    explained = set(re.findall(r"`([a-z0-9_.]+)`", DOCUMENT.read_text()))
    told = set(names(job_report({"path": "", "complete": True, "messages": 0, "bytes": 0, "lost": 0, "problem": ""})))
    # What a tool that covers areas has instead of paint, and its plan besides.
    told |= set(names({"area": reports.area_report_figures(AreaReport(), TraversalReport())}))
    told |= set(names({"plan": {"coverage": reports.planned_coverage_figures([PlannedCoverage(area_m2=1.0)])}}))
    told |= set(names({"gaps": gap_figures(()), "uncovered": uncovered_figures(0.0, ())}))
    assert told <= explained
    figures = {name for name in explained if "." in name and not name.endswith(".md")}
    assert figures == {name for name in told if "." in name}
    assert {"id", "length_m", "width_m"} <= explained & set(reports.segment_figures(SegmentPaint()))
