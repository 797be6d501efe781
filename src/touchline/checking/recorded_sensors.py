"""Sensors of a recording: in each tick the computer gets the recorded frame."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from touchline.onboard.estimation.frame_series import FrameSeries
from touchline.onboard.interface import (
    ACCEL,
    ANGLES,
    MAG,
    TICKS_PER_S,
    AuxiliarySample,
    CameraSample,
    GnssSample,
    ImuSample,
    MagSample,
    SensorFrame,
)
from touchline.schemas.setup import Setup
from touchline.services.robot_sim.sensors.auxiliary_truth import AuxiliaryTruth
from touchline.services.robot_sim.sensors.suite import Sensors
from touchline.services.robot_sim.world.body import BodyState
from touchline.services.robot_sim.world.effects import Effects
from touchline.services.robot_sim.world.objects.surroundings import Surroundings

_GNSS_FIELDS = len(GnssSample._fields)


def frame_at(frames: FrameSeries, row: int) -> SensorFrame:
    """Return the frame of a tick; bumper, battery, tank and operator are as in a robot at rest."""
    readings, tick = frames.readings[row].tolist(), frames.first_tick + row
    imu_tick, mag_tick, encoder_tick = frames.measured[row].tolist()
    fixes = cast("NDArray[Any]", frames.fixes)[frames.arrived[row] : frames.arrived[row + 1]]
    return SensorFrame(
        tick,
        tick / TICKS_PER_S,
        ImuSample(*readings[: ACCEL + 3]),
        MagSample(*readings[MAG:ANGLES]),
        tuple(readings[ANGLES:]),
        tuple(GnssSample(*fix[:_GNSS_FIELDS]) for fix in fixes[np.isnan(fixes["heading_rad"])].tolist()),
        tick - imu_tick,
        tick - mag_tick,
        tick - encoder_tick,
        camera=tuple(map(_pose, fixes[~np.isnan(fixes["heading_rad"])])),
    )


def _pose(sample: np.void) -> CameraSample:
    """Return a camera's pose; square roots of the variances restore the very figures that were squared."""
    sigma_m, sigma_rad = math.sqrt(sample["variance_m2"]), math.sqrt(sample["heading_variance_rad2"])
    stamp_s, east_m, north_m = (float(sample[name]) for name in ("stamp_s", "east_m", "north_m"))
    return CameraSample(
        stamp_s=stamp_s,
        east_m=east_m,
        north_m=north_m,
        heading_rad=float(sample["heading_rad"]),
        sigma_m=sigma_m,
        sigma_rad=sigma_rad,
    )


class RecordedSensors(Sensors):
    """Recorded sensors in place of emulated ones; bumper, battery and tank are the world's.

    Args:
        setup: The robot and its world.
        frames: Sensor frames by tick.
    """

    def __init__(self, setup: Setup, frames: FrameSeries) -> None:
        """Serve frames of a series."""
        super().__init__(setup.vehicle, setup.scenario)
        self._frames, self._full_wh = frames, setup.vehicle.body.battery_wh

    def read(self, tick: int, state: BodyState, effects: Effects | None = None) -> SensorFrame:
        """Return the frame of a tick, as `Sensors`; after the last one nothing new arrives."""
        last = len(self._frames.readings) - 1
        frame = frame_at(self._frames, min(tick - self._frames.first_tick, last))
        late = tick - frame.tick
        return frame._replace(
            tick=tick,
            time_s=tick / TICKS_PER_S,
            gnss=() if late else frame.gnss,
            camera=() if late else frame.camera,
            imu_age_ticks=frame.imu_age_ticks + late,
            mag_age_ticks=frame.mag_age_ticks + late,
            encoder_age_ticks=frame.encoder_age_ticks + late,
            bumper=state.bumper or (effects is not None and effects.bumper),
            battery_fraction=state.battery_wh / self._full_wh,
            tank_l=state.tank_l,
            operator_alive=effects is None or not effects.operator_lost,
        )


class RecordedAuxiliary(AuxiliaryTruth):
    """Recorded measurements of auxiliary sensors in place of emulated ones.

    Args:
        setup: The robot and its world.
        samples: Measurements by the tick in which they arrived.
    """

    def __init__(self, setup: Setup, samples: Mapping[int, tuple[AuxiliarySample, ...]]) -> None:
        """Serve recorded measurements."""
        super().__init__(setup.vehicle, setup.scenario, Surroundings(setup.vehicle, setup.scenario, 0.0))
        self._samples = samples

    def step(self, tick: int, body: BodyState, effects: Effects) -> tuple[AuxiliarySample, ...]:
        """Return what arrived in a tick."""
        return self._samples.get(tick, ())
