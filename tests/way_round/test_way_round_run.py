"""A job of several drives over the bus, as the messages of different topics arrive: in any order."""

from types import SimpleNamespace
from typing import Any

import pytest

from touchline.jobs.single.bus_run import JobOptions
from touchline.jobs.way_round.way_round_run import WayRoundRun
from touchline.schemas.messages import Header, PlanOptions, Time, TraversalReport, WayRound

W = WayRound


def said(at_s: int, **fields: Any) -> WayRound:
    return WayRound(header=Header(stamp=Time(sec=at_s)), things=("person 1",), **fields)


FIRST, PLANS, LAST = said(0, drives=1), said(9, drives=1, state=W.PLANS, continues=True), said(10, drives=2)
ENDS = [TraversalReport(header=Header(stamp=Time(sec=at_s))) for at_s in (10, 20)]


@pytest.mark.parametrize(
    "early", [(FIRST, PLANS, ENDS[0], LAST), (FIRST, PLANS, LAST, ENDS[0])], ids=["in order", "report late"]
)
def test_a_report_ends_the_job_only_if_it_is_of_the_last_drive(early: tuple[Any, ...]) -> None:
    run: Any = WayRoundRun(None, JobOptions("", PlanOptions(), 1.0, None), None)  # type: ignore[arg-type]
    run._truth = run._driven = SimpleNamespace(listen=lambda: None)
    run._of_job.since_s = 0.0
    for message in early:
        run._hear(message)
        assert not run._over
    assert run._why(1) == "goes round person 1"
    run._hear(ENDS[1])
    assert run._over and run._why(2) == ""
