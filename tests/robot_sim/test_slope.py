"""A field that falls as real ones do: the robot learns the slope and paints as on level ground."""

import itertools
import math

import numpy as np
import pytest

from tests.robot_sim.scripted import trajectory
from tests.with_full import with_full
from touchline.core.physical_constants import GRAVITY_MPS2
from touchline.schemas.curves import Curve
from touchline.schemas.messages import TraversalStatus
from touchline.schemas.scenario import GnssNoise, Ground, Scenario
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.fast_runner import FastRunner

TURN = Curve.from_arc((8, 0), (8, 2), math.pi)
BACK = Curve.from_line((8, 4), (0, 4))
AGAIN = Curve.from_arc((0, 4), (0, 2), math.pi)
THERE = Curve.from_line((0, 0), (8, 0))
CURVES = [THERE, TURN, BACK, AGAIN, THERE, Curve.from_line((8, 0), (9, 0))]
PLAN = trajectory(CURVES, [0, 0, 1, 0, 1, 0], ids=["t0", "t1", "far", "t2", "near", "t3"], speed_mps=0.8)
OFFSET = Vehicle().tool.nozzle_y_m
TEMPLATE = Template(
    name="two",
    segments=[
        {"id": "far", "line": {"start": (8.0, 4.0 - OFFSET), "end": (0.0, 4.0 - OFFSET)}},
        {"id": "near", "line": {"start": (0.0, OFFSET), "end": (8.0, OFFSET)}},
    ],
)
WHITE = GnssNoise(white_m=0.00471, gauss_markov_1_m=0.0, burst_share=0.0)


@pytest.mark.parametrize(
    ("grade", "uphill_rad"),
    with_full((0.02, 2.4), full=itertools.product((0.01, 0.02), (0.0, 1.6, 4.0))),
)
def test_paints_on_a_slope_without_a_pause(grade: float, uphill_rad: float) -> None:
    scenario = Scenario(seed=3, gnss=WHITE, ground=Ground(grade=grade, uphill_rad=uphill_rad))
    emulator = Emulator(Vehicle(), scenario)
    emulator.load(PLAN, TEMPLATE)
    emulator.start()
    FastRunner(emulator).run(60_000)
    assert emulator.onboard.state == TraversalStatus.DONE
    assert not [event.text for event in emulator.take_events() if event.severity]
    assert np.percentile(np.abs(emulator.work.ledger.deviation().lateral_m), 95) < 0.01
    learned = emulator.onboard._estimator.ring.learned
    rise = learned.rise_east_mps2 / GRAVITY_MPS2, learned.rise_north_mps2 / GRAVITY_MPS2
    assert rise == pytest.approx([grade * math.cos(uphill_rad), grade * math.sin(uphill_rad)], abs=0.003)
