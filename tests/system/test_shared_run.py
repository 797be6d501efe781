"""Two robots share a template over the bus: each is told how far it may drive by what the other one reports."""

import json
import os
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import chain

import pytest

from tests.meeting import eventually
from tests.painted import read_painted
from tests.sharing.stretches import nearest_m
from tests.system.commands import start_touchline, touchline_here
from tests.system.test_failures import wait_until
from touchline.bus import Bus, BusConfig, CallError
from touchline.bus.health import STARTING
from touchline.bus.ports import free_port
from touchline.jobs.shared import shared_bus_run
from touchline.jobs.shared.shared_bus_run import SharedBusRun, SharedRunSettings
from touchline.jobs.shared.shared_job import APART_M, share_job
from touchline.jobs.shared.shared_robot import fresh_id
from touchline.jobs.shared.team_report import bus_figures
from touchline.jobs.shared.work_evaluation import evaluate_work
from touchline.jobs.watcher import JobFailed
from touchline.recordings.reader import RecordingReader
from touchline.schemas import topics
from touchline.schemas.messages import (
    AuthorizeRequest,
    CommandRequest,
    GetDiagnosticsRequest,
    PlanOptions,
    SetSpeedRequest,
    TraversalStatus,
)
from touchline.schemas.setup import Setup
from touchline.schemas.template import LineSpec, Template, TemplateSegment
from touchline.schemas.vehicles import Vehicle
from touchline.supervision.temporary_system import LocalSystem, ProcessOptions, local_system, watched

GRID = {
    **{f"row-{k}": ((0.0, 3.0 * k), (6.0, 3.0 * k)) for k in range(4)},
    "middle": ((3.0, 9.0), (3.0, 0.0)),
}
TEMPLATE = Template(
    name="grid",
    segments=tuple(
        TemplateSegment(id=name, line=LineSpec(start=start, end=end)) for name, (start, end) in GRID.items()
    ),
)
"""So small that robots are in each other's way."""
JOINT_M2 = 0.01 * TEMPLATE.line_width_m
"""Area that two robots paint twice where one goes on from the other's paint."""
QUICKLY, SLOWLY = 20.0, 2.0
"""Sim time per wall time, and while somebody is to be paused, or killed amid a line."""
STALLED_S = 0.5
"""Time that a team may stand, once it is paused: at work it may be held up for as long by a busy machine."""


class Silent:
    """Says nothing, and knows what it was told should the test fail."""

    def __init__(self):
        self.told = []

    def stage(self, text): ...
    def progress(self, fraction, text): ...
    def event(self, severity, text):
        self.told.append(text)

    def check(self): ...


class Claims:
    """The stretches that robots claim, as they are told."""

    def __init__(self, buses):
        self._inboxes = [bus.inbox([topics.CLAIMED]) for bus in buses]
        self._heard = []

    def hear(self):
        for inbox in self._inboxes:
            self._heard += inbox.messages()

    @property
    def heard(self):
        """All of them in the order in which they were told: robot and message, and its path."""
        return sorted(self._heard, key=lambda told: told[0].source_time_ns)

    def nearest_m(self, vehicle):
        return nearest_m([(sample.namespace, claimed) for sample, claimed in self.heard], vehicle)

    def all_given_up(self):
        self.hear()
        last = {sample.namespace: claimed for sample, claimed in self.heard}
        return len(last) == len(self._inboxes) and not any(claimed.poses for claimed in last.values())


class Pausing(Silent):
    """Hears which stretches the robots claim, and has both pause once for longer than a team may stand."""

    def __init__(self, buses, monkeypatch):
        super().__init__()
        self.claims, self.buses, self.monkeypatch = Claims(buses), buses, monkeypatch
        self.answers, self.resumes_at = [], None

    def check(self):
        self.claims.hear()
        if self.resumes_at is not None and time.monotonic() > self.resumes_at:
            self.resumes_at = None
            self.monkeypatch.undo()
            assert all(pace(bus, QUICKLY) for bus in self.buses)
            self.order(topics.RESUME)

    def progress(self, fraction, text):
        if fraction > 0.1 and not self.answers:
            self.order(topics.PAUSE)
        elif text.startswith("paused: r1 since") and "r2 since" in text and len(self.answers) == 2:
            self.order(topics.PAUSE)
            self.monkeypatch.setattr(shared_bus_run, "STALLED_S", STALLED_S)
            self.resumes_at = time.monotonic() + 3.0 * STALLED_S

    def order(self, service):
        self.answers += [bus.call(service, CommandRequest(request_id=fresh_id())) for bus in self.buses]


@pytest.fixture(scope="module")
def job():
    shared = share_job(TEMPLATE, PlanOptions(), Vehicle(), [None] * 2)
    assert shared.table.gates, "they do come into each other's way here"
    return shared


@pytest.fixture(scope="module")
def recordings(tmp_path_factory):
    return tmp_path_factory.mktemp("recordings")


@pytest.fixture(scope="module")
def system(recordings) -> Iterator[LocalSystem]:
    """Two robots, each a process that is started again when it is killed, for one job after the other."""
    setups = {f"r{number + 1}": Setup().with_seed(number + 1) for number in range(2)}
    options = ProcessOptions(apart=True, without=(topics.PLANNER,), recordings=recordings)
    with local_system(setups, options=options, join_as=topics.OBSERVER) as it:
        it.wait_until_ready(lambda text: None)
        with watched(it):
            yield it


@contextmanager
def begun(system, job, conduct, watcher) -> Iterator[SharedBusRun]:
    """A job that an operator is about to have done, all robots being there."""
    with Bus.open_all(topics.OPERATOR, system.bus.config.of("r1", "r2")) as buses:
        for bus in buses:
            assert eventually(lambda bus=bus: is_ready(bus))
        run = watcher.run = SharedBusRun(buses, job, conduct, watcher)
        try:
            yield run
        except BaseException as error:
            error.add_note(f"it was told {watcher.told}")
            raise


def is_ready(bus) -> bool:
    """Return whether its robot has nothing to do and could be given something."""
    try:
        told = bus.call(topics.diagnostics_service(topics.ROBOT_SIM), GetDiagnosticsRequest(), 10.0)
    except CallError:
        return False
    return not told.diagnostics.status[0].message.startswith(STARTING)


def test_two_robots_paint_a_template_over_the_bus_recorded_in_one_file_though_they_are_paused_for_long(
    system, job, recordings, monkeypatch
):
    record = recordings / "both.mcap"
    nan = AuthorizeRequest(request_id="a", until_m=float("nan"))
    assert "give an arc length" in system.bus.call(topics.AUTHORIZE, nan).message
    early = AuthorizeRequest(request_id="b", until_m=1.0)
    assert "no trajectory is loaded" in system.bus.call(topics.AUTHORIZE, early).message
    pausing = Pausing(system.buses, monkeypatch)
    with begun(system, job, SharedRunSettings(SLOWLY, record=record), pausing) as run:  # until both are paused
        run.run()
    assert run.recording["complete"], run.recording
    assert [answer.message for answer in pausing.answers[2:4]] == ["already paused"] * 2
    assert all(answer.success for answer in pausing.answers) and len(pausing.answers) == 6
    claims = pausing.claims
    assert eventually(claims.all_given_up)
    assert claims.nearest_m(job.vehicle) >= APART_M
    for robot in run.robots:
        kept = RecordingReader(record).messages({f"/{robot.name}/{topics.CLAIMED.name}"})
        told = [each.payload for each, _ in claims.heard if each.namespace == robot.name]
        assert [each.payload for each in kept] == told
    assert [report.success for robot in run.robots for report in robot.reports] == [True, True]
    strokes = list(chain.from_iterable(robot.strokes for robot in run.robots))
    assert {stroke.segment_id for stroke in strokes if stroke.segment_id} == set(GRID)
    for robot, share in zip(run.robots, job.shares, strict=True):
        recorded = read_painted(record, robot.name)
        assert [len(each.x_m) for each in recorded.strokes] == [len(each.x_m) for each in robot.strokes]
        assert recorded.template == share and recorded.report == robot.reports[0]
    paint = evaluate_work(job, run.planned, [work for robot in run.robots for work in robot.works])
    assert paint.metrics.verdict.accepted and paint.metrics.coverage_pct > 99.8
    assert paint.metrics.double_paint_m2 < 0.005


class Killer(Silent):
    """Kills a robot amid a line, with what publishes for it."""

    def __init__(self, system, name):
        super().__init__()
        self.system, self.name, self.slowed, self.killed = system, name, False, False

    def check(self):
        robot = next(each for each in self.run.robots if each.name == self.name)
        if self.killed or robot.assignment is None or robot.status.state != TraversalStatus.RUNNING:
            return
        if not self.slowed:
            self.slowed = all(pace(each.bus, SLOWLY) for each in self.run.robots)
        elif robot.status.spraying and robot.status.coverage_pct > 20.0:
            os.killpg(self.system.supervisor.pid(topics.ROBOT_SIM, self.name), signal.SIGKILL)
            self.killed = all(pace(each.bus, QUICKLY) for each in self.run.robots if each.name != self.name)


class Operator(Killer):
    """Orders that others do the rest of a dead robot, carries it away in the end; hears which stretches they claim."""

    def __init__(self, system, name):
        super().__init__(system, name)
        self.claims, self.answers, self.orders = Claims(system.buses), [], []

    def check(self):
        super().check()
        self.claims.hear()

    def event(self, severity, text):
        super().event(severity, text)
        alive, dead = self.system.buses
        if f"{self.name} is out of service" in text:
            self.give((alive, topics.TAKE_OVER), (dead, topics.TAKE_OVER))
        elif text.startswith(("all is done but", "the rest cannot be done")):
            self.give((dead, topics.REMOVE), (dead, topics.TAKE_OVER))

    def give(self, *orders):
        self.orders.append(threading.Thread(target=self.call, args=orders))
        self.orders[-1].start()

    def call(self, *orders):
        self.answers += [bus.call(order, CommandRequest(request_id=fresh_id()), 60.0) for bus, order in orders]


def joints(works):
    """Number of places where a line goes on in another stroke: beside a dead robot from both sides, then beneath it."""
    ledgers = [work.ledger for work in works]
    painted = [name for each in ledgers for name, m in zip(each.ids, each.covered_by_target_m, strict=True) if m > 0.0]
    return len(painted) - len({name.partition(" (")[0] for name in painted})


def test_when_a_robot_is_killed_the_other_does_the_rest_on_order(system, job):
    operator = Operator(system, "r2")
    with begun(system, job, SharedRunSettings(QUICKLY), operator) as run:
        run.run()
        for orders in operator.orders:
            orders.join()
    assert "r1 is in service" in operator.answers[0].message, operator.told
    assert eventually(operator.claims.all_given_up)
    assert operator.claims.nearest_m(job.vehicle) >= APART_M
    claimed = [(sample.namespace, bool(path.poses)) for sample, path in operator.claims.heard]
    given_up = max(number for number, (robot, _) in enumerate(claimed) if robot == "r2")
    assert ("r2", True) in claimed[:given_up] and ("r1", True) in claimed[given_up:], "before the other does its rest"
    assert [answer.success for answer in operator.answers] == [False, True, True, True]
    assert [(each["robot"], each["order"], each["done"]) for each in run.orders] == [
        ("r1", "take-over", False),
        ("r2", "take-over", True),
        ("r2", "remove", True),
        ("r2", "take-over", True),
    ]
    works = [work for robot in run.robots for work in robot.works]
    told = bus_figures(job, run, evaluate_work(job, run.planned, works))
    assert told["success"] or "painted within 30 mm" in told["reason"], told["reason"]  # a receiver's burst in a row
    assert told["paint"]["coverage_pct"] > 99.8 and told["traversal"]["left_out_m"] == 0.0
    assert told["paint"]["double_paint_m2"] <= 2 * joints(works) * JOINT_M2  # by two receivers
    assert told["robots"]["r2"]["out_of_service"] == "its process is gone" and told["robots"]["r2"]["tasks"] == []


@pytest.mark.full
def test_without_an_operator_the_other_does_what_it_can_reach_beside_the_dead_one(system, job):
    killer = Killer(system, "r1")
    with begun(system, job, SharedRunSettings(QUICKLY, take_over_after_s=1.0), killer) as run:
        try:
            run.run()
        except JobFailed as failed:  # it stands in the way of all that is left of its line
            assert "no remaining work within reach" in " ".join(killer.told)
            assert "not finished: row-" in str(failed)
            return
    works = [work for robot in run.robots for work in robot.works]
    told = bus_figures(job, run, evaluate_work(job, run.planned, works))
    assert not told["success"] and "not accepted" in told["reason"], killer.told
    assert [(each["robot"], each["order"], each["done"]) for each in run.orders] == [("r1", "take-over", True)]
    assert told["paint"]["gap_m"] == pytest.approx(told["traversal"]["left_out_m"], abs=0.15)
    assert 0.0 < told["traversal"]["left_out_m"] < 4.0
    assert told["paint"]["double_paint_m2"] <= joints(works) * JOINT_M2


@pytest.mark.full
def test_where_nobody_orders_it_the_job_ends_and_names_the_lines_that_are_not_painted(system, job):
    conduct, said = (
        SharedRunSettings(QUICKLY, ordered_within_s=2.0),
        "r2 is out of service: its process is gone; nobody has ordered",
    )
    with begun(system, job, conduct, Killer(system, "r2")) as run, pytest.raises(JobFailed, match=said) as failed:
        run.run()
    lines = str(failed.value).partition("not finished: ")[2].split(", ")
    assert lines and set(lines) <= set(GRID)
    assert {segment.id for segment in job.shares[1].segments} & set(lines)


def pace(bus, factor):
    return bus.call(topics.SET_SPEED, SetSpeedRequest(request_id=fresh_id(), factor=factor)).success


class Site:
    """Two robots that paint the lines over a bus of their own, begun from the command line."""

    def __init__(self, folder, *arguments):
        self.config = BusConfig(endpoint=f"tcp/127.0.0.1:{free_port()}")
        template, self.report, self.log = folder / "grid.json", folder / "report.json", folder / "run.log"
        template.write_text(TEMPLATE.to_json())
        # So slowly that a robot can be met amid a line.
        options = ("--robots", "2", "--speed", "4", "--report", str(self.report), *arguments)
        self.run = start_touchline("run", str(template), *options, config=self.config, log=self.log)

    def paints(self, robot):
        """Wait until a robot paints, and has painted some of its share; from its start on both drive slowly."""
        with Bus.open_all(topics.OBSERVER, self.config.of("r1", "r2")) as buses:
            bus = buses[int(robot[1:]) - 1]
            inbox, status = bus.inbox([topics.STATUS], keep="latest"), TraversalStatus()
            slowed = False
            while not (status.spraying and status.coverage_pct > 1.0):
                if status.state == TraversalStatus.RUNNING and not slowed:
                    slowed = all(pace(each, SLOWLY) for each in buses)
                assert self.run.poll() is None, self.said
                status = next((told for _, told in inbox.messages()), status)
                time.sleep(0.01)

    def observer(self, robot):
        return Bus.open(topics.OBSERVER, self.config.of(robot))

    @property
    def said(self):
        return " ".join(self.log.read_text().split())

    def wait_for(self, text, times=1):
        assert eventually(lambda: self.said.count(text) >= times, 200.0), self.said

    def order(self, what, robot):
        return touchline_here("order", what, "--robot", robot, config=self.config)

    def end(self):
        """The exit code and the report."""
        code = self.run.wait(200)
        return code, json.loads(self.report.read_text())


@pytest.fixture
def site(tmp_path):
    sites = []

    def begin(*arguments):
        sites.append(Site(tmp_path, *arguments))
        return sites[-1]

    yield begin
    for each in sites:
        each.run.terminate()
        each.run.wait()


@pytest.mark.full
def test_who_is_set_going_again_does_its_share_and_whose_rest_others_do_never_drives_again(site):
    team = site("--take-over-after", "1000")  # long after an operator has ordered it
    team.paints("r2")
    with team.observer("r1") as other, team.observer("r2") as robot:

        def asked(order):
            return robot.call(order, CommandRequest(request_id=fresh_id()), 60.0).success

        assert pace(robot, 1.0) and pace(other, 0.4)  # at work until the orders are given, however long that takes
        assert asked(topics.ESTOP)
        team.wait_for("r2 is out of service")
        team.wait_for("the others take over in 1000 s")
        wait_until(lambda: asked(topics.RESET))  # right after a stop it is refused
        team.wait_for("r2 is in service again")
        assert asked(topics.RESUME) and asked(topics.ESTOP)
        team.wait_for("r2 is out of service", times=2)
        assert "r1 is in service" in team.order("take-over", "r1").stderr
        assert team.order("remove", "r2").returncode == 0
        done = team.order("take-over", "r2")
        assert done.returncode == 0, done.stderr
        team.wait_for("the rest is done: r1:")
        assert pace(other, 0.2)  # it is at work while the other is set going again, however long that takes
        wait_until(lambda: asked(topics.RESET))
        assert asked(topics.RESUME)
        assert pace(other, 30.0)
    code, told = team.end()
    assert code == 0, team.said
    assert told["paint"]["coverage_pct"] > 99.8
    assert told["paint"]["double_paint_m2"] < 2 * JOINT_M2
