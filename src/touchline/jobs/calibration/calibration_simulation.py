"""Calibration drive of an emulated robot, in one process."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from touchline.jobs.calibration.rest_schedule import RestSchedule
from touchline.jobs.single.simulation import GivenDrive, Outcome, Products, carry_out
from touchline.schemas.setup import Setup
from touchline.services.planner.calibration_drive import CalibrationDrive
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.loaded_job import Taking


def drive_to_calibrate(
    setup: Setup,
    drive: CalibrationDrive,
    record: Path,
    progress: Callable[[float, str], None] = lambda done, doing: None,
) -> Outcome:
    """Have an emulated robot do a calibration drive, and record it.

    Args:
        setup: The robot and its world.
        drive: The planned drive.
        record: MCAP file to write.
        progress: Called with the fraction done and the present stage.

    Raises:
        CommandRefused: The robot does not take the plan.
        RecordingError: The recording cannot be written.
    """
    emulator = Emulator(setup.vehicle, setup.scenario, setup.onboard)
    given = GivenDrive(drive.plan.trajectory, None, Taking.CARRIED, drive.cause)
    return carry_out(emulator, given, Products(record=record), progress, _Rests(emulator, drive))


class _Rests:
    """Rests of the robot, as a `Rerouting` that never changes the drive."""

    def __init__(self, emulator: Emulator, drive: CalibrationDrive) -> None:
        self._emulator, self._schedule = emulator, RestSchedule(drive.rests)

    def begins(self, drive: GivenDrive, told: Callable[[], None]) -> None:
        """Keep the robot at the start."""
        self._emulator.authorize(self._schedule.until_m)

    def gives_up(self) -> str:
        """Let the robot go on after a rest."""
        emulator, estimate = self._emulator, self._emulator.onboard.estimate
        at_m = emulator.onboard.status.arc_length_m
        if self._schedule.look(emulator.time_s, at_m, estimate.speed_mps, estimate.yaw_rate_radps):
            emulator.authorize(self._schedule.until_m)
        return ""

    def replacement(self) -> None:
        """Nothing replaces the drive."""

    def next_drive(self) -> None:
        """Nothing follows it."""

    def refused(self, why: str) -> None:
        """Nothing else can be refused."""
