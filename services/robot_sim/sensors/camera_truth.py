"""Emulated overhead cameras: poses of the whole robot, with white noise, and pictures in which it is not found."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Final

import numpy as np
from numpy.typing import NDArray

from touchline.core.angles import wrapped
from touchline.core.arcs import unit
from touchline.core.jit import kernel
from touchline.core.random import STREAM_CAMERA, normal, uniform
from touchline.core.records import Record
from touchline.onboard.interface import TICKS_PER_S, CameraSample
from touchline.schemas.scenario import Scenario
from touchline.schemas.vehicles import OVERHEAD_CAMERA, Vehicle
from touchline.services.robot_sim.sensors import position_report as r
from touchline.services.robot_sim.sensors.camera_views import (
    NO_CAMERA,
    CameraViews,
    camera_that_sees,
    noise_factor,
)
from touchline.services.robot_sim.sensors.moment import Moment
from touchline.services.robot_sim.sensors.transport import usual_arrival
from touchline.services.robot_sim.world import effects as e

LEAST_CLAIMED_M: Final = 0.001
"""Smallest standard deviation of a position that a camera reports."""
LEAST_CLAIMED_RAD: Final = 0.001
"""Smallest standard deviation of a heading that it reports."""

# Channels of STREAM_CAMERA.
_MISSED: Final = 0
_LATE: Final = 1
_EAST: Final = 2
_NORTH: Final = 3
_HEADING: Final = 4

Floats = NDArray[np.float64]


class CameraFigures(Record):
    """Rate, latency and noise of one camera in one scenario."""

    rate_hz: int
    """Pictures per second; 0: no camera sees the robot."""
    latency_s: float
    jitter_s: float
    white_m: float
    """Standard deviation of the position along an axis."""
    white_rad: float
    """Standard deviation of the heading."""
    dropout_share: float
    """Share of the pictures in which the robot is not found."""


class CameraState(Record):
    """State of the camera."""

    figures: CameraFigures
    report: Annotated[Floats, r.COLUMNS]
    """Last report, columns of `position_report`."""


@kernel
def due(tick: int, camera: Sequence[CameraState]) -> bool:
    """Return whether a picture is taken at the end of a tick: at the camera's rate, as evenly as ticks allow.

    Args:
        tick: Tick of the onboard computer.
        camera: (1,) state.
    """
    rate_hz = camera[0].figures.rate_hz
    taken: bool = rate_hz > 0 and tick * rate_hz % TICKS_PER_S < rate_hz
    return taken


@kernel
def measure(moment: Moment, camera: Sequence[CameraState], views: CameraViews) -> bool:
    """Find the robot in the picture that is taken now: its pose with white noise, the same along every axis.

    Args:
        moment: End of the tick in which the picture is taken.
        camera: (1,) state; `report` is filled in.
        views: Several cameras, or none, if one sees all the ground.

    Returns:
        Whether the robot is found.
    """
    seed, tick, state, f = moment.seed, moment.tick, moment.state[0], camera[0].figures
    if moment.effects[0].camera_out or uniform(seed, STREAM_CAMERA, tick, _MISSED) < f.dropout_share:
        return False
    east, north, heading, noise = state.east_m, state.north_m, state.heading_rad, 1.0
    if len(views.cameras.places) > 0:
        number = camera_that_sees(views, east, north, tick)
        if number == NO_CAMERA:
            return False
        one = views.cameras.places[number]
        noise = noise_factor(one, east, north)
        off = complex(east - one.x_m, north - one.y_m) * unit(one.off_rad)
        east, north = one.x_m + off.real + one.off_x_m, one.y_m + off.imag + one.off_y_m
        heading += one.off_rad
    effects = moment.effects[0]
    east, north, heading = east + effects.camera_east_m, north + effects.camera_north_m, heading + effects.camera_rad
    report = camera[0].report
    report[:] = math.nan
    report[r.TICK], report[r.STAMP_S] = tick, tick / TICKS_PER_S
    report[r.EAST] = east + noise * f.white_m * normal(seed, STREAM_CAMERA, tick, _EAST)
    report[r.NORTH] = north + noise * f.white_m * normal(seed, STREAM_CAMERA, tick, _NORTH)
    report[r.HEADING] = wrapped(heading + noise * f.white_rad * normal(seed, STREAM_CAMERA, tick, _HEADING))
    report[r.VARIANCE] = max(f.white_m, LEAST_CLAIMED_M) ** 2
    report[r.HEADING_VARIANCE] = max(f.white_rad, LEAST_CLAIMED_RAD) ** 2
    report[r.FIX], report[r.SATELLITES], report[r.CORRECTION_AGE] = e.FIXED, 0.0, 0.0
    return True


@kernel
def arrival_tick(moment: Moment, camera: Sequence[CameraState]) -> int:
    """Return the tick in which a report of this moment arrives, but for faults of its messages.

    Args:
        moment: End of the tick in which the picture is taken.
        camera: (1,) state.
    """
    tick, f = moment.tick, camera[0].figures
    arrival: int = usual_arrival(tick, f.latency_s, f.jitter_s, uniform(moment.seed, STREAM_CAMERA, tick, _LATE))
    return arrival


def unpack(row: list[float]) -> CameraSample:
    """Return the pose in a report.

    Args:
        row: (COLUMNS,) numbers of `position_report`.
    """
    return CameraSample(
        row[r.STAMP_S],
        row[r.EAST],
        row[r.NORTH],
        row[r.HEADING],
        math.sqrt(row[r.VARIANCE]),
        math.sqrt(row[r.HEADING_VARIANCE]),
    )


def make_camera(vehicle: Vehicle, scenario: Scenario) -> CameraState:
    """Make the camera of a scenario; it takes no pictures if the vehicle is positioned otherwise.

    Args:
        vehicle: Vehicle, with its kind of positioning.
        scenario: Effective scenario, which has the noise.
    """
    noise, made = scenario.camera, CameraState()
    made.figures.reset(
        rate_hz=noise.rate_hz if vehicle.positioning == OVERHEAD_CAMERA else 0,
        latency_s=noise.latency_s,
        jitter_s=noise.latency_jitter_s,
        white_m=noise.white_m,
        white_rad=noise.white_rad,
        dropout_share=noise.dropout_share,
    )
    return made
