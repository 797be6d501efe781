"""An emulated robot that stops for somebody: its paint, and the same bits whether or not ticks run in kernels."""

import numpy as np

from benchmarks._joints import joints
from benchmarks._stops_for_things import NOTHING, SCAN_TICKS, ShownRobot, post
from tests.robot_sim.scripted import along_x
from touchline.onboard.perception.hits import Hits
from touchline.schemas.messages import TraversalStatus
from touchline.schemas.scenario import Scenario
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle

PLAN = along_x(0, 2, 9, 12, sprayed=[0, 1, 0])
TEMPLATE = Template(name="one", segments=[{"id": "s1", "line": {"start": (2.0, -0.41124), "end": (9.0, -0.41124)}}])


def robot():
    return ShownRobot(Vehicle(), Scenario(seed=3), PLAN, TEMPLATE)


def test_paint_after_protective_stops_has_no_gap():
    shown = robot()
    for place in (3.0, 5.5, 7.0):
        while shown.x_m < place:
            shown.run(1)
        shown.things = post(shown.x_m + 1.25, 0.0, 0.2)
        shown.run(200)
        assert shown.emulator.onboard.state == TraversalStatus.PAUSED
        shown.things = NOTHING
    while shown.emulator.active:
        shown.run(SCAN_TICKS)
    found = joints(shown.emulator.work.ledger)
    assert len(found) == 3
    assert max(joint.gap_m for joint in found) < 0.01
    assert max(joint.double_m for joint in found) < 0.02


def test_ticks_in_kernels_and_single_ticks_give_the_same_bits():
    fast, single = robot(), robot()
    things = post(8.0, 0.3)
    fast.things = things
    fast.run(900)
    emulator = single.emulator
    while emulator.tick_count < 900:
        if emulator.tick_count % SCAN_TICKS == 0:
            emulator.onboard.protection.take(Hits(things, emulator.tick_count, 0.02))
        emulator.tick()
    assert fast.x_m == single.x_m
    assert np.array_equal(fast.emulator.onboard.estimate.covariance, emulator.onboard.estimate.covariance)
    assert 4.0 < fast.x_m < 7.0
