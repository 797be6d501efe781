"""Emulation of a log: the world and sensors of a scenario, driven by the wheel speeds of the log."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from touchline.checking.reality.imu_statistics import sampled
from touchline.checking.reality.log_samples import LogSamples
from touchline.onboard.estimation.aiding.gnss_aiding import FIX_FIXED
from touchline.onboard.interface import ANGLES, GYRO, MAG, Command
from touchline.schemas.scenario import Scenario
from touchline.services.robot_sim.fault_timeline import FaultTimeline
from touchline.services.robot_sim.sensors.suite import Sensors
from touchline.services.robot_sim.true_vehicle import true_vehicle
from touchline.services.robot_sim.world.world import World

_SLICE_TICKS = 1000


def emulated(
    log: LogSamples, scenario: Scenario, imu_hz: float, progress: Callable[[float], None] = lambda done: None
) -> LogSamples:
    """Return what a scenario's robot senses that turns its wheels as a log's robot did.

    No computer drives: the motors are commanded the rates that the log's encoders show.

    Args:
        log: The log.
        scenario: World, truth and noise.
        imu_hz: Rate of the log's IMU; that of the emulation is sampled and interpolated alike.
        progress: Called with the fraction done.

    Raises:
        SpecError: The scenario is about something that the log's vehicle does not have.
    """
    vehicle = true_vehicle(log.vehicle, scenario.truth)
    world, sensors = World(vehicle, scenario), Sensors(vehicle, scenario)
    timeline = FaultTimeline(scenario.faults, vehicle.drive)
    n = len(log.time_s)
    readings, fixes = np.zeros((n, ANGLES + 2)), []
    for i, rates in enumerate(log.wheel_rates_radps.tolist()):
        tick = i + 1
        timeline.step(tick)
        world.step(Command(tuple(rates), False, False), tick, timeline.effects)
        frame = sensors.read(tick, world.state, timeline.effects)
        readings[i] = sensors.transport.readings[: ANGLES + 2]
        fixes += [(fix.stamp_s, fix.east_m, fix.north_m) for fix in frame.gnss if fix.fix == FIX_FIXED]
        if tick % _SLICE_TICKS == 0:
            progress(tick / n)
    time_s = np.arange(1, n + 1) / 100
    imu = sampled(time_s, readings[:, GYRO:MAG], imu_hz)
    return LogSamples(time_s, readings[:, ANGLES:], imu, np.array(fixes).reshape(-1, 3), log.reported_m, log.vehicle)
