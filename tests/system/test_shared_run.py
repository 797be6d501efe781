"""Two robots share a template over the bus: each is told how far it may drive by what the other one reports."""

import json
import os
import signal
import time
from itertools import chain

import pytest

from tests.sharing.test_shared_simulation import GRID, TEMPLATE
from tests.system.commands import start_touchline, touchline
from tests.system.test_failures import wait_until
from touchline.schemas import topics
from touchline.schemas.messages import (
    AuthorizeRequest,
    GetDiagnosticsRequest,
    PlanOptions,
    SetSpeedRequest,
    TraversalStatus,
)
from touchline.schemas.setup import Setup
from touchline.schemas.vehicles import Vehicle
from touchline.services.bus import Bus, BusConfig
from touchline.services.bus.ports import free_port
from touchline.services.runs.bus_run import JobFailed
from touchline.services.runs.recorded_paint import read_painted
from touchline.services.runs.sharing.judged import judged
from touchline.services.runs.sharing.shared_bus_run import Conduct, SharedBusRun
from touchline.services.runs.sharing.shared_job import share_job
from touchline.services.runs.sharing.shared_robot import fresh_id
from touchline.services.system.diagnostics import read_health
from touchline.services.system.temporary_system import ProcessOptions, local_system


class Silent:
    def stage(self, text): ...
    def progress(self, fraction, text): ...
    def event(self, severity, text): ...
    def check(self): ...


@pytest.mark.xdist_group("shared-run")
def test_two_robots_paint_a_template_over_the_bus_recorded_in_one_file(tmp_path):
    record = tmp_path / "both.mcap"
    job = share_job(TEMPLATE, PlanOptions(), Vehicle(), [None] * 2)
    setups = {f"r{number + 1}": Setup().with_seed(number + 1) for number in range(2)}
    with local_system(setups, options=ProcessOptions(apart=True, recordings=tmp_path)) as system:
        system.wait_until_ready(lambda text: None)
        nan = AuthorizeRequest(request_id="a", until_m=float("nan"))
        assert "give an arc length" in system.bus.call(topics.AUTHORIZE, nan).message
        early = AuthorizeRequest(request_id="b", until_m=1.0)
        assert "no trajectory is loaded" in system.bus.call(topics.AUTHORIZE, early).message
        run = SharedBusRun(system.buses, job, Conduct(-1.0, record=record), Silent())
        run.run()
    assert run.recording["complete"], run.recording
    assert [report.success for robot in run.robots for report in robot.reports] == [True, True]
    strokes = list(chain.from_iterable(robot.strokes for robot in run.robots))
    assert {stroke.segment_id for stroke in strokes if stroke.segment_id} == set(GRID)
    for robot, share in zip(run.robots, job.shares, strict=True):
        recorded = read_painted(record, robot.name)
        assert [len(each.x_m) for each in recorded.strokes] == [len(each.x_m) for each in robot.strokes]
        assert recorded.template == share and recorded.report == robot.reports[0]
    paint = judged(job, run.planned, [work for robot in run.robots for work in robot.works])
    assert paint.metrics.verdict.accepted and paint.metrics.coverage_pct > 99.8
    assert paint.metrics.double_paint_m2 < 0.005


def pace(bus, factor):
    return bus.call(topics.SET_SPEED, SetSpeedRequest(request_id=fresh_id(), factor=factor)).success


class Site:
    """Two robots that paint the six lines over a bus of their own, begun from the command line."""

    def __init__(self, folder, *arguments):
        self.config = BusConfig(endpoint=f"tcp/127.0.0.1:{free_port()}")
        template, self.report, self.log = folder / "grid.json", folder / "report.json", folder / "run.log"
        template.write_text(TEMPLATE.to_json())
        options = ("--robots", "2", "--speed", "30", "--report", str(self.report), *arguments)
        self.run = start_touchline("run", str(template), *options, config=self.config, log=self.log)

    def paints(self, robot, coverage_pct):
        """Wait until a robot paints, and has painted so much of its share; from its start on both drive slowly."""
        with Bus.open_all(topics.OBSERVER, self.config.of("r1", "r2")) as buses:
            bus = buses[int(robot[1:]) - 1]
            inbox, status = bus.inbox([topics.STATUS], keep="latest"), TraversalStatus()
            slowed = False
            while not (status.spraying and status.coverage_pct > coverage_pct):
                if status.state == TraversalStatus.RUNNING and not slowed:
                    slowed = all(pace(each, 4.0) for each in buses)
                assert self.run.poll() is None, self.said
                status = next((told for _, told in inbox.messages()), status)
                time.sleep(0.01)

    def pace(self, robot, factor):
        """Have a robot's sim time pass at so many times real time."""
        with Bus.open(topics.OBSERVER, self.config.of(robot)) as bus:
            assert pace(bus, factor)

    def kill_amid_a_line(self, robot):
        """End the whole process group of a robot, what publishes for it included; where it was then."""
        self.paints(robot, 20.0)
        with Bus.open(topics.OBSERVER, self.config.of(robot)) as bus:
            asked = bus.call(topics.diagnostics_service(topics.ROBOT_SIM), GetDiagnosticsRequest(), 30.0)
            os.killpg(read_health(topics.ROBOT_SIM, asked.diagnostics).pid, signal.SIGKILL)
        self.wait_for(f"{robot} is out of service")

    @property
    def said(self):
        return " ".join(self.log.read_text().split())

    def wait_for(self, text):
        wait_until(lambda: text in self.said)

    def order(self, what, robot):
        return touchline("order", what, "--robot", robot, config=self.config)

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


@pytest.mark.xdist_group("shared-run")
def test_when_a_robot_is_killed_the_other_does_the_rest_on_order(site):
    team = site()
    team.kill_amid_a_line("r2")
    assert "r1 is in service" in team.order("take-over", "r1").stderr
    assert team.order("remove", "r2").returncode == 0
    done = team.order("take-over", "r2")
    assert done.returncode == 0, done.stderr
    code, told = team.end()
    assert code == 0, team.said
    assert told["paint"]["coverage_pct"] > 99.8 and told["traversal"]["left_out_m"] == 0.0
    assert told["paint"]["double_paint_m2"] < 0.02 * TEMPLATE.line_width_m
    assert [(each["robot"], each["order"], each["done"]) for each in told["orders"]] == [
        ("r1", "take-over", False),
        ("r2", "remove", True),
        ("r2", "take-over", True),
    ]
    assert told["robots"]["r2"]["out_of_service"] == "its process is gone" and told["robots"]["r2"]["tasks"] == []


@pytest.mark.xdist_group("shared-run")
def test_without_an_operator_the_other_does_what_it_can_reach_beside_the_dead_one(site):
    team = site("--take-over-after", "1")
    team.kill_amid_a_line("r1")
    code, told = team.end()
    assert code == 1 and "not accepted" in told["reason"], team.said
    assert told["paint"]["gap_m"] == pytest.approx(told["traversal"]["left_out_m"], abs=0.15)
    assert 0.0 < told["traversal"]["left_out_m"] < 4.0
    assert told["paint"]["double_paint_m2"] < 0.02 * TEMPLATE.line_width_m


@pytest.mark.xdist_group("shared-run")
def test_who_is_set_going_again_does_its_share_and_whose_rest_others_do_never_drives_again(site):
    team = site("--speed", "5")
    team.paints("r2", 1.0)
    for robot in ("r1", "r2"):  # both are at work until the orders are given, however long that takes
        team.pace(robot, 1.0)
    assert team.order("estop", "r2").returncode == 0
    team.wait_for("r2 is out of service")
    time.sleep(1.5)  # a reset right after a stop is refused
    assert team.order("reset", "r2").returncode == 0
    team.wait_for("r2 is in service again")
    assert team.order("resume", "r2").returncode == 0
    assert team.order("estop", "r2").returncode == 0
    wait_until(lambda: team.said.count("r2 is out of service") == 2)
    assert team.order("remove", "r2").returncode == 0
    assert team.order("take-over", "r2").returncode == 0
    team.wait_for("the rest is done: r1:")
    team.pace("r1", 0.2)  # it is at work while the other is set going again, however long that takes
    assert team.order("reset", "r2").returncode == 0
    assert team.order("resume", "r2").returncode == 0
    team.pace("r1", 30.0)
    code, told = team.end()
    assert code == 0, team.said
    assert told["paint"]["coverage_pct"] > 99.8
    assert told["paint"]["double_paint_m2"] < 0.02 * TEMPLATE.line_width_m


@pytest.mark.xdist_group("shared-run")
def test_where_nobody_orders_it_the_job_ends_and_names_the_lines_that_are_not_painted():
    job = share_job(TEMPLATE, PlanOptions(), Vehicle(), [None] * 2)
    setups = {f"r{number + 1}": Setup().with_seed(number + 1) for number in range(2)}
    with local_system(setups, options=ProcessOptions(apart=True)) as system:
        system.wait_until_ready(lambda text: None)

        class Killer(Silent):
            pid = system.supervisor.pid(topics.ROBOT_SIM, "r2")

            def progress(self, fraction, text):
                if fraction > 0.2 and self.pid:
                    os.killpg(self.pid, signal.SIGKILL)
                    self.pid = None

        run = SharedBusRun(system.buses, job, Conduct(20.0, ordered_within_s=2.0), Killer())
        with pytest.raises(JobFailed, match="r2 is out of service: its process is gone; nobody has ordered") as failed:
            run.run()
    lines = str(failed.value).partition("not finished: ")[2].split(", ")
    assert lines and set(lines) <= set(GRID)
    assert {segment.id for segment in job.shares[1].segments} & set(lines)
