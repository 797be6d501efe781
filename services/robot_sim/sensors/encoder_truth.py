"""Emulated encoders: the cumulative angle of each actuator in whole counts, so that no fraction is ever lost."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel
from touchline.core.random import STREAM_ENCODER, uniform
from touchline.core.records import Record
from touchline.onboard.interface import ACTUATORS, ANGLES
from touchline.schemas.scenario import Scenario
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.sensors.moment import TURN_ON_TICK, Moment

Floats = NDArray[np.float64]


class EncoderFigures(Record):
    """Resolution of a robot's encoders in one scenario."""

    count_rad: Annotated[Floats, ACTUATORS]
    """Angle of one count of each actuator's encoder; 0: not quantised."""


class EncoderState(Record):
    """State of the encoders; arrays are by actuator, in the drive's order."""

    figures: EncoderFigures
    phase_rad: Annotated[Floats, ACTUATORS]
    """Place between two counts at which an encoder stood at switch-on."""
    missed_rad: Annotated[Floats, ACTUATORS]
    """Angle that an encoder did not count while it had dropped out."""
    last_rad: Annotated[Floats, ACTUATORS]
    """True angle in the tick before."""


@kernel
def switch_on(encoders: Sequence[EncoderState], seed: int) -> None:
    """Draw where each encoder stands between two counts.

    Args:
        encoders: (1,) state with its figures; the rest is filled in.
        seed: Seed of the scenario.
    """
    s = encoders[0]
    for actuator in range(len(s.phase_rad)):
        phase = uniform(seed, STREAM_ENCODER, TURN_ON_TICK, actuator)
        s.phase_rad[actuator] = s.figures.count_rad[actuator] * phase


@kernel
def measure(moment: Moment, encoders: Sequence[EncoderState], readings: Floats) -> None:
    """Read the encoders at the end of a tick.

    Args:
        moment: End of the tick.
        encoders: (1,) state, updated.
        readings: (READINGS,) of `onboard/interface.py`; the angles of the actuators [rad] are filled in.
    """
    state, effects, s = moment.state[0], moment.effects[0], encoders[0]
    for actuator in range(len(s.last_rad)):
        angle, count = state.angles_rad[actuator], s.figures.count_rad[actuator]
        if effects.encoder_out[actuator]:
            s.missed_rad[actuator] += angle - s.last_rad[actuator]
        s.last_rad[actuator] = angle
        angle -= s.missed_rad[actuator]
        if count > 0.0:
            angle = math.floor((angle + s.phase_rad[actuator]) / count) * count
        readings[ANGLES + actuator] = angle


def make_encoders(vehicle: Vehicle, scenario: Scenario) -> EncoderState:
    """Make the encoders of a drive that has just been switched on.

    Args:
        vehicle: Vehicle, whose drive has the resolution of each encoder.
        scenario: Effective scenario, which says whether they are quantised.
    """
    actuators = vehicle.drive.actuators
    made = EncoderState.sized(len(actuators))()
    if scenario.encoder.quantised:
        made.figures.count_rad[:] = [actuator.encoder_rad for actuator in actuators]
    switch_on(made.array, scenario.seed)
    return made
