"""Sessions with objects and lidars: same bits on both ways and from a restored state, and contacts as they are told."""

import json
import math

import numpy as np
import pytest

from tests.robot_sim.bus_rig import setup
from tests.robot_sim.scripted import along_x
from touchline.schemas import topics
from touchline.schemas.cdr import decode
from touchline.schemas.errors import CommandRefused, SpecError
from touchline.schemas.messages import ContactReport, LaserScan, Range
from touchline.schemas.scenario import Scenario
from touchline.schemas.spec import parse
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.fast_runner import FastRunner
from touchline.services.robot_sim.initial_state import InitialState
from touchline.services.robot_sim.telemetry import MOST_TICKS, Telemetry
from touchline.services.robot_sim.world.objects import things as t

STRAIGHT = along_x(0, 6, sprayed=[0], speed_mps=0.8)
LIDAR = {"kind": "lidar", "name": "front", "beams": 180, "step_rad": math.pi / 90, "x_m": 0.3}
RANGER = {"kind": "ranger", "name": "left", "x_m": 0.75, "y_m": 0.2}
WALKERS = (
    {"kind": "person", "x_m": 3.0, "y_m": 3.0, "motion": {"kind": "wander", "corner": [2, 2], "opposite": [8, 5]}},
    {"kind": "dog", "x_m": 5.0, "y_m": -3.0, "motion": {"kind": "path", "points": [[0, -3], [5, -3]], "loop": True}},
    {"kind": "bench", "x_m": 4.0, "y_m": 2.0},
)
CROSSING = {
    "kind": "person",
    "x_m": 4.0,
    "y_m": -1.5,
    "motion": {"kind": "step-in-front", "near_m": 3.0, "ahead_m": 1.0},
}


class Drive:
    """A drive of 6 m, with all that it publishes."""

    def __init__(self, *objects, fast=True, sensors=(LIDAR, RANGER)):
        robot = setup(follower="pure-pursuit")
        scenario = robot.scenario.model_copy(update={"objects": Scenario(objects=objects).objects})
        self.emulator = Emulator(Vehicle(sensors=sensors), scenario, robot.onboard)
        self.fast, self.told = fast, []

    def go(self, template=None):
        """Drive until it has ended, or paused for good."""
        emulator, telemetry = self.emulator, Telemetry(self.emulator)
        emulator.load(STRAIGHT, template)
        telemetry.loaded(STRAIGHT, template)
        emulator.start()
        telemetry.news()
        runner, last = FastRunner(emulator), emulator.time_s + 15.0
        while emulator.active and emulator.time_s < last:
            if self.fast:
                self.told += telemetry.after(runner.step(telemetry.until_due(MOST_TICKS), telemetry.rows))
            else:
                emulator.tick()
                self.told += telemetry.after_tick()
        self.reports = telemetry.reports()
        return self

    def of(self, topic):
        """Messages of a topic."""
        return [decode(topic.type, payload) for which, payload in self.told if which is topic]


def test_fast_and_slow_ticks_give_the_same_bits():
    fast, slow = (Drive(*WALKERS, CROSSING, fast=fast).go() for fast in (True, False))
    assert fast.told == slow.told
    assert fast.emulator.work.contacts == slow.emulator.work.contacts
    scans = fast.of(topics.SCAN)
    assert len(scans) > 20
    assert all(isinstance(each, LaserScan) and each.header.frame_id == "front" for each in scans)
    assert np.isfinite(scans[0].ranges).sum() > 3
    assert all(isinstance(each, Range) for each in fast.of(topics.RANGE))


def test_a_contact_while_moving_is_told_and_is_no_success():
    drive = Drive({"kind": "post", "x_m": 4.0, "y_m": 0.0, "name": "flag"}, sensors=()).go()  # no lidar: it cannot stop
    report = drive.reports.contacts
    assert isinstance(report, ContactReport)
    assert report.while_moving == 1
    assert report.contacts[0].thing == "flag"
    assert report.contacts[0].robot_mps > 0.1
    assert not drive.reports.traversal.success
    assert any("hit flag" in each.text for each in drive.of(topics.EVENTS))


def test_obstacles_of_the_template_are_there():
    template = Template.model_validate(
        {
            "name": "line",
            "segments": [{"id": "side", "line": {"start": (0.0, 0.0), "end": (6.0, 0.0)}}],
            "obstacles": [{"id": "hut", "corners": [(4.0, -1.0), (5.0, -1.0), (5.0, 1.0), (4.0, 1.0)]}],
        }
    )
    drive = Drive(sensors=()).go(template)
    assert [each.thing for each in drive.emulator.work.contacts] == ["hut"]
    assert drive.emulator.world.pose.east_m < 4.0


def test_a_later_job_is_the_same_from_its_recorded_state():
    whole = Drive(*WALKERS)
    whole.go()
    whole.told.clear()
    whole.go()
    state = InitialState.from_text(whole.emulator.initial.text)
    again = Drive(*WALKERS)
    again.emulator.restore(state)
    again.go()
    assert [each for each in again.told if each[0] is topics.SCAN] == [
        each for each in whole.told if each[0] is topics.SCAN
    ]
    assert np.array_equal(
        again.emulator.world.surroundings.things.movers, whole.emulator.world.surroundings.things.movers
    )


def test_motions_go_where_they_should():
    drive = Drive(*WALKERS, CROSSING, sensors=())
    for _ in range(800):
        drive.emulator.tick()
    wanderer, dog, waiting = drive.emulator.world.surroundings.things.movers
    assert 1.9 <= wanderer[t.EAST] <= 8.1
    assert 1.9 <= wanderer[t.NORTH] <= 5.1
    assert np.hypot(*(wanderer[[t.EAST, t.NORTH]] - (3.0, 3.0))) > 0.5
    assert dog[t.NORTH] == pytest.approx(-3.0)
    assert tuple(waiting[[t.EAST, t.NORTH]]) == (4.0, -1.5)


@pytest.mark.parametrize(
    ("fault", "finite"), [({"kind": "lidar-blind"}, 0), ({"kind": "lidar-false-returns", "share": 0.2}, 25)]
)
def test_faults_of_lidars(fault, finite):
    robot = setup()
    scenario = Scenario.model_validate(robot.scenario.model_dump(mode="json") | {"faults": [fault]})
    emulator = Emulator(Vehicle(sensors=[LIDAR]), scenario, robot.onboard)
    for _ in range(10):
        emulator.tick()
    (sample,) = emulator.samples
    assert np.isfinite(sample.values).sum() == pytest.approx(finite, abs=14)


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"kind": "cow"}, "kind is 'cow'"),
        ({"kind": "bench", "mass_kg": 3.0}, "give radius_m, too"),
        ({"kind": "goal", "motion": {"kind": "intercept"}}, "only a disc with a mass moves"),
        ({"kind": "post", "outline": [[0, 0], [1, 1], [0, 1], [1, 0]]}, "must not cross"),
        ({"kind": "wall", "radius_m": 1.0, "outline": [[0, 0], [1, 0], [1, 1]]}, "not both"),
    ],
)
def test_objects_that_cannot_be_are_refused(given, told):
    with pytest.raises(SpecError, match=told):
        parse(Scenario, json.dumps({"objects": [{"x_m": 1.0, "y_m": 2.0} | given]}), "s.json")


@pytest.mark.parametrize(
    "thing",
    [
        {"kind": "machine", "heading_rad": 0.3},
        {"kind": "post"},
        {"kind": "person", "motion": {"kind": "wander", "corner": [0, 0], "opposite": [9, 9]}},
    ],
)
def test_a_robot_is_not_put_where_something_hard_stands(thing):
    grass = {"kind": "grass", "x_m": 0.0, "y_m": 0.0, "radius_m": 3.0}
    drive = Drive(grass, {"kind": "ball", "x_m": 3.0, "y_m": 1.0}, {"x_m": 0.0, "y_m": 0.0, "name": "it", **thing})
    with pytest.raises(CommandRefused, match=r'begin at \(0.00, 0.00\), where "it" stands'):
        drive.go()
