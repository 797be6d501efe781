"""A robot's report of its job is told from an earlier one."""

from touchline.jobs.single.stale_reports import JobMessageFilter
from touchline.schemas.messages import TraversalReport, TraversalStatus
from touchline.schemas.messages.standard import Header, Time


def at(second: int) -> Header:
    return Header(stamp=Time(sec=second))


def test_nothing_is_of_the_job_before_the_robot_is_ready_for_it() -> None:
    said = JobMessageFilter()
    assert not said.status(TraversalStatus(header=at(40), state=TraversalStatus.DONE))
    assert not said.report(TraversalReport(header=at(40)))
    assert not said.begun
    assert said.status(TraversalStatus(header=at(40), state=TraversalStatus.READY))
    assert said.begun and said.since_s == 40.0
    assert not said.report(TraversalReport(header=at(40))), "kept for late joiners; sim time rests between jobs"
    assert said.status(TraversalStatus(header=at(40), state=TraversalStatus.RUNNING))
    assert said.report(TraversalReport(header=at(59)))


def test_another_job_begins_anew() -> None:
    said = JobMessageFilter()
    said.status(TraversalStatus(header=at(0), state=TraversalStatus.READY))
    said.forget()
    assert not said.status(TraversalStatus(header=at(19), state=TraversalStatus.DONE))
    assert not said.report(TraversalReport(header=at(19)))
    said.status(TraversalStatus(header=at(19), state=TraversalStatus.READY))
    assert said.since_s == 19.0
