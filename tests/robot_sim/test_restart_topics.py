"""A robot's process that has been started again sends every topic that it sent the first time."""

import pytest

from tests.meeting import caught_up
from tests.robot_sim.bus_rig import ask, process, turn_until
from tests.robot_sim.scripted import along_x
from tests.robot_sim.test_ready_with_kernels import job
from touchline.schemas import topics
from touchline.schemas.messages import TraversalStatus
from touchline.schemas.setup import Setup as RollerSetup
from touchline.schemas.template import Template
from touchline.schemas.vehicles.shipped import CLAY_ROLLER
from touchline.services.robot_sim.journal import Journal

JOB_S = 1.5
PLAN = along_x(0, 20, 20.6, 21.1, sprayed=[0, 1, 0], speed_mps=0.8)
"""So long that a robot whose orders are answered late, while sim time passes, is far from its line all the same."""
TEMPLATE = Template(name="far", segments=[{"id": "line", "line": {"start": (20.0, -0.41124), "end": (20.6, -0.41124)}}])
ONCE = {topics.ORDERS.name}
"""Topics of events, which need not happen again."""


class Heard:
    """The topics that a robot has sent."""

    def __init__(self, operator, robot):
        self._operator, self._inbox, self._robot = operator, operator.inbox(topics.TOPICS), robot

    def take(self, bus):
        caught_up(self._operator, bus)
        return {sample.topic.name for sample in self._inbox.drain()}

    def drive(self, bus, **how):
        """Load and start a job; the topics sent in its first moments."""
        self.take(bus)
        loaded = ask(self._operator, self._robot, topics.LOAD, **how)
        assert loaded.success, loaded.message
        assert ask(self._operator, self._robot, topics.START).success
        emulator = self._robot._emulator
        until_s = emulator.time_s + JOB_S
        turn_until(self._robot, lambda: emulator.time_s > until_s)
        assert emulator.onboard.state == TraversalStatus.RUNNING, emulator.onboard.status
        return self.take(bus)


@pytest.mark.parametrize("rolls", [False, True], ids=["marker", "roller"])
def test_what_a_first_start_sends_a_restart_sends_as_well(bus, operator, tmp_path, rolls, monkeypatch):
    changes, work = {}, {"trajectory": PLAN, "template_json": TEMPLATE.model_dump_json()}
    if rolls:
        given, changes = job(CLAY_ROLLER), {"follower": "pure-pursuit"}
        work = {"trajectory": given.trajectory, "template_json": given.template_json}
        monkeypatch.setattr("tests.robot_sim.bus_rig.Setup", lambda **parts: RollerSetup(vehicle=CLAY_ROLLER, **parts))
    sent = []
    for how in ({}, {"resume": True}):
        with Journal(tmp_path / "journal") as journal:
            caught_up(bus, operator)
            robot = process(bus, 2.0, journal, **changes)  # at real time a busy machine would have it pause
            heard = Heard(operator, robot)
            idle = heard.take(bus)
            sent.append((idle, heard.drive(bus, **work, **how)))
    first, again = sent
    assert first[0] - again[0] == set()
    assert first[1] - again[1] - ONCE == set()
    assert (topics.AREA.name if rolls else topics.SPRAYER.name) in again[1]
