"""Reports: what they say of a recording that broke off, and that every figure is explained."""

import re
from collections.abc import Mapping
from pathlib import Path

from schemas.messages import PlanOptions, PlanReport, PlanResponse, SegmentPaint, TraversalReport, TraversalStatus
from services import reports
from services.bus import CallError
from services.bus.counters import Counters
from services.job import Job, JobOptions

DOCUMENT = Path(__file__).parents[2] / "docs" / "reports.md"


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


def job_report(recording):
    job = Job(DeadBus(), JobOptions("{}", PlanOptions(), -1.0, Path("x.mcap"), "cause"), Deaf())
    plan = PlanResponse(success=True, report=PlanReport())
    return job._report(plan, TraversalStatus(), TraversalReport(success=True, total_time_s=2.0), 1.0, recording)


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
    assert told <= explained
    figures = {name for name in explained if "." in name and not name.endswith(".md")}
    assert figures == {name for name in told if "." in name}
    assert {"id", "length_m", "width_m"} <= explained & set(reports.segment_figures(SegmentPaint()))
