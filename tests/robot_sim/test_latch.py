"""An emergency stop is latched in the journal: a killed process cannot release it."""

import pytest

from tests.robot_sim.test_journal_kept import Robot, disk_of
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.cdr import decode
from touchline.schemas.faults import parse_fault
from touchline.services.robot_sim.journal import _SLOT, Journal


@pytest.mark.parametrize("cause", ["order", "bumper"])
def test_the_next_process_is_stopped_until_it_is_reset_and_then_goes_on(path, cause):
    journal = Journal(path)  # never closed: killed
    robot = Robot(journal)
    robot.load()
    robot.drive(until_m=1.0)
    if cause == "order":
        assert robot.order(topics.ESTOP).message == "done"
    else:
        robot.emulator.inject_fault(parse_fault('{"kind": "bumper", "duration_s": 0.1}'))
        robot.emulator.tick()
        robot.commands.note_progress()
    journal._close()

    with Journal(path) as kept:
        robot = Robot(kept)
        assert robot.emulator.onboard.state == m.TraversalStatus.ESTOPPED
        reason = robot.emulator.onboard.status.reason
        assert "from before the restart" in reason
        assert ("bumper" in reason) == (cause == "bumper")
        told = [decode(m.Event, payload).text for topic, payload in robot.commands.take() if topic is topics.EVENTS]
        assert any("from before the restart" in text for text in told)
        refused = robot.load(resume=True)
        assert not refused.success and "reset it first" in refused.message
        assert not robot.order(topics.START).success
    with Journal(path) as kept:  # again
        robot = Robot(kept)
        assert robot.emulator.onboard.status.reason == reason
        assert robot.order(topics.RESET).success
        assert robot.load(resume=True).success
        assert robot.order(topics.START).success
    with Journal(path) as kept:
        assert Robot(kept).emulator.onboard.state == m.TraversalStatus.IDLE


def test_without_a_journal_it_stops_and_says_that_it_would_not_last(path):
    with disk_of(100), Journal(path) as journal:
        robot = Robot(journal)
        answer = robot.order(topics.ESTOP)
        robot.hear(robot.commands.take())
    assert answer.success and "would not survive a restart" in answer.message
    assert robot.emulator.onboard.state == m.TraversalStatus.ESTOPPED
    assert any("would not survive a restart" in text for text in robot.warnings)


def test_an_older_journal_has_no_latch_and_a_torn_one_stops(path):
    path.parent.mkdir()
    path.write_bytes(b"\xff" * (2 * _SLOT))
    with Journal(path) as journal:
        assert journal.latched is None
        journal.latch("emergency stop")
        assert journal.latched == "emergency stop"
    torn = bytearray(path.read_bytes())
    torn[2 * _SLOT + 20] ^= 1
    path.write_bytes(torn)
    with Journal(path) as journal:
        assert journal.latched == ""
        assert Robot(journal).emulator.onboard.state == m.TraversalStatus.ESTOPPED
