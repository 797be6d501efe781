"""A robot that keeps a journal: on a full disk, beside another robot, and from note to note."""

import errno
import os
import resource
from contextlib import contextmanager

import numpy as np
import pytest

from tests.robot_sim.test_journal import PLAN
from tests.robot_sim.test_journal import found as found_with
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.cdr import decode
from touchline.schemas.errors import CommandRefused
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.scenario import Scenario
from touchline.schemas.setup import Setup
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.command_handlers import Commands
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.fast_runner import UNLOGGED, FastRunner
from touchline.services.robot_sim.journal import Journal
from touchline.services.robot_sim.paint import record
from touchline.services.robot_sim.paint.metrics import paint_metrics
from touchline.services.robot_sim.setup_text import SetupText
from touchline.services.robot_sim.telemetry import MOST_TICKS, Telemetry

QUIET = Setup(scenario=Scenario(noise="none"), onboard=OnboardConfig(follower="pure-pursuit"))
SETUP = SetupText.of(QUIET)


def found(path):
    return found_with(path, setup=SETUP)


@contextmanager
def disk_of(size):
    """Files cannot grow beyond this many bytes: what a full disk is to a program."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.fixture(scope="module", autouse=True)
def undisturbed():
    """The hash of a session without a journal: what a kernel's cache takes on the disk is had before that is full."""
    robot = Robot(None, publishes=True)
    assert robot.load().success
    robot.drive()
    return robot.telemetry.final.traversal.session_hash


class Robot:
    """One that is told to drive the plan, and keeps this journal; it takes long to publish all that it does."""

    def __init__(self, journal, *, publishes=False):
        self.publishes = publishes
        self.emulator = Emulator(QUIET.vehicle, QUIET.scenario, QUIET.onboard)
        self.telemetry = Telemetry(self.emulator)
        self.commands = Commands(self.emulator, self.telemetry, lambda factor: None, journal)
        self.warnings = []

    def load(self, plan=PLAN, **fields):
        request = m.LoadRequest(request_id="load", trajectory=plan, **fields)
        try:
            answer = self.commands.load(self.commands.prepare_load(request))
        except CommandRefused as error:
            answer = self.commands.refuse_load(str(error))
        self.hear(self.commands.take())
        return answer

    def hear(self, payloads):
        events = [decode(m.Event, payload) for topic, payload in payloads if topic is topics.EVENTS]
        self.warnings += [event.text for event in events if event.code == "journal"]

    def order(self, service):
        return self.commands.handlers[service](m.CommandRequest(request_id="x"))

    def drive(self, until_m=99.0):
        """Drive to an arc length, exact to the tick, or to the end, as the robot's process does."""
        emulator, telemetry, runner = self.emulator, self.telemetry, FastRunner(self.emulator)
        if emulator.onboard.state == m.TraversalStatus.READY:
            emulator.start()
        while emulator.active and (left_m := until_m - emulator.onboard.status.arc_length_m) > 0.0:
            most = min(MOST_TICKS, max(1, int(left_m / 0.02)))
            done = runner.step(telemetry.until_due(most), telemetry.rows if self.publishes else UNLOGGED)
            self.hear(self.commands.note_progress())
            if self.publishes:
                telemetry.after(done)


def test_a_disk_that_is_full_from_the_start_stops_nobody(path, undisturbed):
    with disk_of(100), Journal(path) as journal:
        robot = Robot(journal, publishes=True)
        assert robot.load().success
        (warning,) = robot.warnings
        assert os.strerror(errno.EFBIG) in warning and "cannot be kept" in warning
        robot.drive()
        assert robot.emulator.onboard.state == m.TraversalStatus.DONE
        assert robot.warnings == [warning]
        assert robot.telemetry.final.traversal.session_hash == undisturbed
        refused = robot.load(resume=True)
    assert not refused.success and warning in refused.message


def test_a_disk_that_fills_up_costs_the_paint_only_and_says_so_once(path, monkeypatch):
    monkeypatch.setattr(record, "_CHUNK", 4096)
    with disk_of(4096), Journal(path) as journal:
        robot = Robot(journal)
        assert robot.load().success
        assert robot.warnings == []
        robot.drive(until_m=3.8)
        (warning,) = robot.warnings
        assert "not kept for a restart any more" in warning and os.strerror(errno.EFBIG) in warning
    painted = robot.emulator.work.ledger.points
    with Journal(path) as journal:
        robot = Robot(journal)
        answer = robot.load(resume=True)
        assert answer.success
        (warning,) = robot.warnings
        lost = painted - robot.emulator.work.ledger.points
        assert 0 < lost < painted
        assert warning == f"{lost} of {painted} points of the paint so far are missing in all figures"
        assert warning in answer.message
        robot.drive()
        assert paint_metrics(robot.emulator.work.ledger).gap_m == pytest.approx(lost / 100, abs=0.05)


@pytest.mark.parametrize("where", ["journal", "paint", "directory"])
def test_a_path_that_is_no_file_stops_nobody(path, where):
    if where == "directory":
        path.parent.write_text("a file where the directory should be")
    else:
        path.with_suffix(f".{where}").mkdir(parents=True)
    with Journal(path) as journal:
        assert "cannot be kept" in journal.problem
        robot = Robot(journal)
        assert robot.load().success
        robot.drive(until_m=0.5)
        assert robot.warnings == [journal.problem]


def test_the_second_of_two_copies_leaves_the_firsts_journal_alone(path):
    with Journal(path) as first, Journal(path) as second:
        assert first.problem == ""
        assert "another robot keeps its journal in" in second.problem
        one, two = Robot(first), Robot(second)
        assert one.load().success and two.load().success
        one.drive(until_m=3.0)
        two.drive()
        assert one.warnings == []
        assert two.warnings == [second.problem]
        refused = two.load(resume=True)
        assert not refused.success and second.problem in refused.message
        place = one.emulator.onboard.checkpoint
    with Journal(path) as third:
        checkpoint, remains = third.unfinished(PLAN, SETUP)
        assert checkpoint == place
        assert len(remains.paint) == one.emulator.work.ledger.points > 0


def test_a_kept_journal_does_not_change_the_session(path, undisturbed):
    with Journal(path) as journal:
        robot = Robot(journal, publishes=True)
        assert robot.load().success
        robot.drive()
        assert robot.warnings == []
        assert robot.telemetry.final.traversal.session_hash == undisturbed


def test_what_was_under_way_can_be_resumed_until_something_else_is(path):
    with Journal(path) as journal:
        robot = Robot(journal)
        robot.load()
        robot.drive(until_m=3.0)
    with Journal(path) as journal:
        robot = Robot(journal)
        assert robot.load().success, "anew, and not started"
        robot.hear(robot.commands.note_progress())
        assert robot.load(resume=True).success
    with Journal(path) as journal:
        robot = Robot(journal)
        assert robot.load().success
        robot.drive(until_m=1.0)
        assert journal.unfinished(PLAN, SETUP)[0].arc_length_m < 1.1
        assert len(journal.unfinished(PLAN, SETUP)[1].paint) == 0


def test_what_is_done_cannot_be_resumed(path):
    with Journal(path) as journal:
        robot = Robot(journal)
        robot.load()
        robot.drive()
    with Journal(path) as journal:
        refused = Robot(journal).load(resume=True)
    assert not refused.success and "nothing to resume" in refused.message


def test_a_note_every_few_ticks_will_do(path):
    with Journal(path) as journal:
        robot = Robot(journal)
        robot.load()
        robot.emulator.start()
        while robot.emulator.onboard.status.arc_length_m < 3.0:
            for _ in range(7):
                robot.emulator.tick()
            assert robot.commands.note_progress() == []
        points = robot.emulator.work.ledger.rows(0)
    _, remains = found(path)
    assert np.array_equal(remains.paint, points)


def test_tank_and_battery_are_after_a_restart_as_they_were_and_what_is_filled_up_then_stays(path):
    full_l, full_wh = Vehicle().tool.tank_l, Vehicle().body.battery_wh
    with Journal(path) as journal:
        robot = Robot(journal)
        robot.emulator.world.state.tank_l = 3.0
        robot.load()
        robot.drive(until_m=3.0)
        left = robot.emulator.world.supplies
    assert left[0] < 3.0 and left[1] < full_wh
    with Journal(path) as journal:
        robot = Robot(journal)
        assert robot.emulator.world.supplies == left
        assert robot.order(topics.REFILL_TANK).success
        assert robot.emulator.world.supplies[:2] == (full_l, left[1])
        robot.hear(robot.commands.note_progress())
    with Journal(path) as journal:  # killed once more, before it went on
        robot = Robot(journal)
        assert robot.emulator.world.supplies[:2] == (full_l, left[1])
        assert robot.load(resume=True).success
        robot.drive(until_m=3.5)
        assert robot.emulator.onboard.state == m.TraversalStatus.RUNNING
        assert full_l - 0.1 < robot.emulator.world.supplies[0] < full_l
        assert robot.order(topics.ABORT).success
    with Journal(path) as journal:  # another job is done with what is left
        robot = Robot(journal)
        begun = robot.emulator.world.supplies
        assert robot.load().success
        assert robot.emulator.initial is not None, "its recording is to be checked"
        assert robot.emulator.world.supplies == begun


def test_a_robot_of_another_setup_has_its_own_levels(path):
    with Journal(path) as journal:
        robot = Robot(journal)
        robot.load()
        robot.drive(until_m=3.0)
    with Journal(path) as journal:
        other = Emulator(QUIET.vehicle, Scenario(noise="none", seed=5), QUIET.onboard)
        Commands(other, Telemetry(other), lambda factor: None, journal)
        assert other.world.supplies[:2] == (Vehicle().tool.tank_l, Vehicle().body.battery_wh)
