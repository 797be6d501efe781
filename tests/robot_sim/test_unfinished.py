"""The rest of a job: after an abort, in the same process or another one, and by somebody who has no plan."""

import numpy as np
import pytest

from tests.robot_sim.scripted import along_x
from tests.robot_sim.test_journal import PLAN
from tests.robot_sim.test_journal_kept import QUIET, Robot
from tests.robot_sim.test_resume import joints
from tests.with_full import with_full
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.cdr import decode
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.fast_runner import FastRunner
from touchline.services.robot_sim.journal import Journal
from touchline.services.robot_sim.paint.metrics import paint_metrics
from touchline.services.robot_sim.recovery_state import restored_from

DRIVE = along_x(0, 1, sprayed=[0])
ABORTED, DONE, IDLE = m.TraversalStatus.ABORTED, m.TraversalStatus.DONE, m.TraversalStatus.IDLE


class Teller(Robot):
    """A robot whose word on what is unfinished is heard."""

    def __init__(self, journal):
        super().__init__(journal)
        self.unfinished = []
        self.hear(self.commands.take())

    def hear(self, payloads):
        super().hear(payloads)
        self.unfinished += [
            decode(m.UnfinishedJob, payload) for topic, payload in payloads if topic is topics.UNFINISHED
        ]

    def take(self, plan=None, **fields):
        answer = self.load(plan if plan is not None else m.Trajectory(), **fields)
        assert answer.success, answer.message

    def order(self, service):
        answer = super().order(service)
        self.hear(self.commands.take())
        assert answer.success, answer.message

    def give_up(self, at_m):
        self.drive(until_m=at_m)
        self.order(topics.ABORT)
        self.drive()
        assert self.emulator.onboard.state == ABORTED


@pytest.fixture(scope="module")
def whole_pct():
    """Result of the job without an interruption."""
    robot = Robot(None)
    robot.load()
    robot.drive()
    return paint_metrics(robot.emulator.work.ledger).coverage_pct


@pytest.mark.parametrize(
    ("at", "reset"),
    with_full((2.5, True), full=((1.0, True), (1.0, False), (2.5, False), (3.9, False), (3.9, True))),
)
def test_a_job_that_was_aborted_is_gone_on_with_and_nothing_is_painted_twice(path, whole_pct, at, reset):
    with Journal(path) as journal:
        robot = Teller(journal)
        robot.take(PLAN)
        robot.give_up(at)
        told = robot.unfinished[-1]
        assert told.total_length_m == 5.0 and told.reason == "aborted by the operator"
        assert told.done_pct == pytest.approx(100.0 * max(at - 2.0, 0.0) / 2.0, abs=8.0)
        if reset:
            robot.order(topics.RESET)
        before = robot.emulator.work.ledger.rows(0)
        robot.take(resume=True)
        assert np.array_equal(robot.emulator.work.ledger.rows(0), before)
        assert robot.unfinished[-1] == told, "until it has set off"
        robot.drive()
        assert robot.unfinished[-1].total_length_m == 0.0
        assert robot.emulator.onboard.state == DONE
        assert paint_metrics(robot.emulator.work.ledger).coverage_pct >= whole_pct - 1.0
        assert all(-0.03 < joint < 0.01 for joint in joints(robot.emulator))


def test_another_process_tells_what_is_left_and_needs_no_plan_to_go_on(path, whole_pct):
    with Journal(path) as journal:
        robot = Teller(journal)
        assert robot.unfinished == [m.UnfinishedJob()]
        robot.take(PLAN)
        robot.drive(until_m=3.0)
        done_pct = robot.emulator.onboard.painted.coverage_pct
    with Journal(path) as journal:
        again = Teller(journal)
        (told,) = again.unfinished
        assert told.done_pct == pytest.approx(done_pct, abs=4.0) and told.total_length_m == 5.0
        assert told.reason == "the robot was restarted"
        again.take(resume=True)
        again.drive()
        assert paint_metrics(again.emulator.work.ledger).coverage_pct >= whole_pct - 1.0
    with Journal(path) as journal:
        assert Teller(journal).unfinished == [m.UnfinishedJob()]


def test_a_drive_in_between_leaves_the_rest_of_the_job_and_another_job_does_not(path):
    with Journal(path) as journal:
        robot = Teller(journal)
        robot.take(PLAN)
        robot.give_up(3.0)
        told = robot.unfinished[-1]
        robot.take(DRIVE)
        robot.drive()
        assert robot.unfinished[-1] == told
    with Journal(path) as journal:
        robot = Teller(journal)
        robot.take(resume=True)
        robot.order(topics.ABORT)
        robot.drive()
        robot.take(resume=True)
        robot.drive(until_m=3.8)
        assert robot.unfinished[-1].total_length_m == 0.0
        robot.order(topics.ABORT)
        robot.drive()
        robot.take(PLAN)
        robot.drive(until_m=0.5)
        assert robot.unfinished[-1].total_length_m == 0.0
        assert journal.checkpoint.arc_length_m < 0.6


def test_a_job_that_was_never_started_is_not_unfinished(path):
    with Journal(path) as journal:
        robot = Teller(journal)
        robot.take(PLAN)
        robot.order(topics.ABORT)
        robot.hear(robot.commands.note_progress())
        assert robot.unfinished == [m.UnfinishedJob()]


def test_a_plan_that_the_journal_lost_is_not_told_of_but_resumed_by_who_has_it(path):
    with Journal(path) as journal:
        robot = Teller(journal)
        robot.take(PLAN)
        robot.drive(until_m=3.0)
    path.with_suffix(".job").write_bytes(b"torn")
    with Journal(path) as journal:
        again = Teller(journal)
        assert again.unfinished == [m.UnfinishedJob()]
        again.take(PLAN, resume=True)


def test_an_abort_and_what_came_after_it_can_be_done_again_from_the_orders(path, monkeypatch):
    """As a check of a recording does: the load tells where, with what and with how much in the tank it went on."""
    with Journal(path) as journal:
        robot, orders = Teller(journal), []
        note = robot.emulator.orders.note
        monkeypatch.setattr(
            robot.emulator.orders,
            "note",
            lambda tick, name, **details: (orders.append((tick, name, details)), note(tick, name, **details)),
        )
        robot.take(PLAN)
        robot.give_up(2.7)
        robot.order(topics.REFILL_TANK)
        full = robot.emulator.world.supplies[0]
        robot.take(resume=True)
        assert robot.emulator.world.supplies[0] == full
        robot.drive()
    again = Emulator(QUIET.vehicle, QUIET.scenario, QUIET.onboard)
    runner = FastRunner(again)
    assert [name for _, name, _ in orders] == ["load", "start", "abort", "refill-tank", "load", "start"]
    for tick, name, details in orders:
        runner.run(tick - again.tick_count)
        if name == "load":
            again.load(PLAN, None, *restored_from(details))
        else:
            getattr(again, name.replace("-", "_"))()
    runner.run(10_000)
    assert again.tick_count == robot.emulator.tick_count
    assert np.array_equal(again.work.ledger.rows(0), robot.emulator.work.ledger.rows(0))
    assert again.world.supplies == robot.emulator.world.supplies
