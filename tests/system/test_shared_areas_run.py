"""Two rollers cover areas over the bus; they are paused for longer than a team may stand, and one of them is killed."""

import json
import os
import signal
import time
from unittest.mock import ANY

import pytest

from touchline.cli.choices import load_vehicle
from touchline.jobs.shared import shared_bus_run
from touchline.jobs.shared.shared_areas import share_areas
from touchline.jobs.shared.shared_robot import fresh_id
from touchline.jobs.shared.shared_run_settings import SharedRunSettings
from touchline.jobs.shared.team_report import bus_figures
from touchline.jobs.shared.work_evaluation import evaluate_work
from touchline.jobs.single.recorded_paint import read_painted
from touchline.jobs.watcher import JobFailed
from touchline.schemas import topics
from touchline.schemas.messages import CommandRequest, PlanOptions, SetSpeedRequest
from touchline.schemas.setup import Setup
from touchline.schemas.template import Area, Polygon, Template
from touchline.supervision.temporary_system import ProcessOptions, local_system

STALLED_S = 1.0
"""How long a team may stand, once it is paused: at work it may be held up for as long by a busy machine."""


def box(x, y, wide, high):
    return ((x, y), (x + wide, y), (x + wide, y + high), (x, y + high))


TEMPLATE = Template(
    name="pans",
    areas=(Area(id="south", outline=box(0, 0, 11, 6)), Area(id="north", outline=box(0, 20, 11, 6))),
    boundary=Polygon(corners=box(-12, -12, 35, 50)),  # with a way out from wherever the other has to stop
)


SLOWLY = 4.0
"""Sim time per wall time of the first robot from then on: it has most of its own to do when the other is killed."""


class Operator:
    """Watches, orders both robots to pause for a while, twice each, and kills the second one later."""

    def __init__(self, monkeypatch):
        self.monkeypatch = monkeypatch
        self.buses, self.answers, self.said = [], [], []
        self.resumed_at, self.stood, self.kill, self.second_done = None, False, None, None

    def stage(self, text): ...

    def event(self, severity, text):
        self.said.append(text)

    def check(self):
        if self.resumed_at is not None and time.monotonic() > self.resumed_at:
            self.resumed_at = None
            self.monkeypatch.undo()
            assert self.buses[0].call(topics.SET_SPEED, SetSpeedRequest(request_id=fresh_id(), factor=SLOWLY)).success
            self.order(topics.RESUME)

    def progress(self, fraction, text):
        self.said.append(text)
        if fraction > 0.1 and not self.answers:
            for _ in range(2):
                self.order(topics.PAUSE)
        elif self.stood and self.resumed_at is None and self.kill is not None and self.second_done() > 0.6:
            self.kill()
            self.kill = None
        elif text.startswith("paused: r1") and "r2" in text and not self.stood:
            self.stood = True
            self.monkeypatch.setattr(shared_bus_run, "STALLED_S", STALLED_S)
            self.resumed_at = time.monotonic() + 3.0 * STALLED_S

    def order(self, service):
        self.answers += [bus.call(service, CommandRequest(request_id=fresh_id())) for bus in self.buses]


@pytest.mark.full
def test_two_rollers_cover_areas_over_the_bus_though_they_are_paused_for_long_and_one_is_killed(tmp_path, monkeypatch):
    record, vehicle, operator = tmp_path / "both.mcap", load_vehicle("clay-roller"), Operator(monkeypatch)
    job = share_areas(TEMPLATE, PlanOptions(coverage_pct=50.0), vehicle, [None] * 2)
    setups = {f"r{number + 1}": Setup(vehicle=vehicle).with_seed(number + 1) for number in range(2)}
    options = ProcessOptions(apart=True, without=(topics.PLANNER,), recordings=tmp_path)
    with local_system(setups, options=options) as system:
        system.wait_until_ready(lambda text: None)
        operator.buses = system.buses
        pid = system.supervisor.pid(topics.ROBOT_SIM, "r2")
        operator.kill = lambda: os.killpg(pid, signal.SIGKILL)
        conduct = SharedRunSettings(20.0, take_over_after_s=0.5, record=record)
        run = shared_bus_run.SharedBusRun(system.buses, job, conduct, operator)
        operator.second_done = lambda: run.robots[1].furthest_m / job.paths[1].end_m
        try:
            run.run()
        except JobFailed as failed:
            pytest.fail(f"{failed}; {operator.said}")
    told = bus_figures(
        job, run, evaluate_work(job, run.planned, [work for robot in run.robots for work in robot.works])
    )
    json.dumps(told)
    assert told["area"]["accepted"], told["reason"]
    # Whether its telemetry can be asked again by then what it has sent last, once its process came back, is chance.
    assert told["success"] or "telemetry of r2 could not be asked" in told["reason"]
    assert [answer.message for answer in operator.answers[2:4]] == ["already paused"] * 2
    assert all(answer.success for answer in operator.answers) and len(operator.answers) == 6
    assert any(text.startswith("paused: r1 since") and "r2 since" in text for text in operator.said)
    assert told["orders"] == [{"robot": "r2", "order": "take-over", "done": True, "outcome": ANY}]
    assert any(text.startswith("the rest is done: r1:") for text in operator.said)
    # The true ground of both, on the whole template, is what was to be covered in the end, round the one that is dead.
    area, tasks = told["area"], told["robots"]["r1"]["tasks"]
    assert area["area_m2"] == pytest.approx(132.0) and area["of_planned_pct"] > 99.0
    assert area["missed_m2"] < told["traversal"]["left_out_m2"] + 4.0 < 25.0
    assert tasks[0]["area"]["area_m2"] == pytest.approx(66.0) and 10.0 < tasks[1]["area"]["area_m2"] < 100.0
    assert area["body_outside_m"] == 0.0 and 0.5 < told["traversal"]["closest_bodies_m"] < 30.0
    assert told["robots"]["r2"]["tasks"] == []
    recorded = read_painted(record, "r1")
    assert recorded.template == run.job.shares[0] and recorded.area == run.robots[0].areas[-1]
