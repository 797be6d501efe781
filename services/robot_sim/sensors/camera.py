"""The camera overhead: it sees the whole robot, pose by pose, and now and then does not find it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Final

import numpy as np
from numpy.typing import NDArray

from touchline.core.angles import wrapped
from touchline.core.jit import kernel
from touchline.core.random import STREAM_CAMERA, normal, uniform
from touchline.core.records import Record
from touchline.onboard.interface import TICKS_PER_S, CameraSample
from touchline.schemas.scenario import Scenario
from touchline.schemas.vehicles import OVERHEAD_CAMERA, Vehicle
from touchline.services.robot_sim.sensors import position_report as r
from touchline.services.robot_sim.sensors.moment import Moment
from touchline.services.robot_sim.world import effects as e

LEAST_CLAIMED_M: Final = 0.001
"""A camera never claims better than this, nor than:"""
LEAST_CLAIMED_RAD: Final = 0.001

# What is drawn in STREAM_CAMERA.
_MISSED: Final = 0
LATE: Final = 1
_EAST: Final = 2
_NORTH: Final = 3
_HEADING: Final = 4

Floats = NDArray[np.float64]


class CameraFigures(Record):
    """Of one camera in one scenario."""

    rate_hz: int
    """0: the robot is not seen by any."""
    latency_s: float
    jitter_s: float
    white_m: float
    """1 σ along an axis, as of the heading:"""
    white_rad: float
    dropout_share: float
    """Of the pictures, in which it does not find the robot."""


class Camera(Record):
    """Its state."""

    figures: CameraFigures
    report: Annotated[Floats, r.COLUMNS]
    """The last one made."""


@kernel
def due(tick: int, camera: Sequence[Camera]) -> bool:
    """Whether a picture is taken at the end of a tick: as many in a second as the rate says, as evenly as ticks allow.

    Args:
        tick: Of the onboard computer.
        camera: (1,) it.
    """
    rate_hz = camera[0].figures.rate_hz
    taken: bool = rate_hz > 0 and tick * rate_hz % TICKS_PER_S < rate_hz
    return taken


@kernel
def find(moment: Moment, camera: Sequence[Camera]) -> bool:
    """Find the robot in the picture that is taken now: its pose with white noise, the same along every axis.

    Args:
        moment: At which the picture is taken.
        camera: (1,) its state; `report` is filled.

    Returns:
        Whether it is found.
    """
    seed, tick, state, f = moment.seed, moment.tick, moment.state[0], camera[0].figures
    if moment.effects[0].camera_out or uniform(seed, STREAM_CAMERA, tick, _MISSED) < f.dropout_share:
        return False
    report = camera[0].report
    report[:] = math.nan
    report[r.TICK], report[r.STAMP_S] = tick, tick / TICKS_PER_S
    report[r.EAST] = state.east_m + f.white_m * normal(seed, STREAM_CAMERA, tick, _EAST)
    report[r.NORTH] = state.north_m + f.white_m * normal(seed, STREAM_CAMERA, tick, _NORTH)
    report[r.HEADING] = wrapped(state.heading_rad + f.white_rad * normal(seed, STREAM_CAMERA, tick, _HEADING))
    report[r.VARIANCE] = max(f.white_m, LEAST_CLAIMED_M) ** 2
    report[r.HEADING_VARIANCE] = max(f.white_rad, LEAST_CLAIMED_RAD) ** 2
    report[r.FIX], report[r.SATELLITES], report[r.CORRECTION_AGE] = e.FIXED, 0.0, 0.0
    return True


def unpack(row: list[float]) -> CameraSample:
    """The pose in a row of `position_report`."""
    return CameraSample(
        row[r.STAMP_S],
        row[r.EAST],
        row[r.NORTH],
        row[r.HEADING],
        math.sqrt(row[r.VARIANCE]),
        math.sqrt(row[r.HEADING_VARIANCE]),
    )


def make_camera(vehicle: Vehicle, scenario: Scenario) -> Camera:
    """One with the figures of this scenario, which must be effective; none if the vehicle is positioned otherwise."""
    noise, made = scenario.camera, Camera()
    made.figures.reset(
        rate_hz=noise.rate_hz if vehicle.positioning == OVERHEAD_CAMERA else 0,
        latency_s=noise.latency_s,
        jitter_s=noise.latency_jitter_s,
        white_m=noise.white_m,
        white_rad=noise.white_rad,
        dropout_share=noise.dropout_share,
    )
    return made
