"""Rehearsal: a short job of a throw-away robot, with a pause, a fault and a restart, which runs every kernel."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from itertools import pairwise
from typing import Final

from touchline.schemas.curves import Curve
from touchline.schemas.errors import CommandRefused
from touchline.schemas.faults import parse_fault
from touchline.schemas.messages import Actuation, Trajectory, TraversalStatus
from touchline.schemas.setup import Setup
from touchline.schemas.template import Area, LineSpec, Template, TemplateSegment
from touchline.schemas.trajectories import assemble, segment, velocity
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.fast_runner import FastRunner
from touchline.services.robot_sim.recovery_state import EarlierWork
from touchline.services.robot_sim.telemetry import MOST_TICKS, Telemetry

_SPEED_MPS: Final = 0.3
_BEFORE_M: Final = 1.0
"""Straight before the work: enough to find the heading, for which the robot would otherwise go back several times."""
_WORK_M: Final = 0.5
_MOST_TICKS: Final = 2000
"""More ticks than the job takes."""
_FAULT: Final = '{"kind": "encoder-dropout", "duration_s": 0.05}'


def rehearse(setup: Setup) -> None:
    """Let a robot set off, pause and end in the middle of its work, and another one continue from there to the end.

    Args:
        setup: Setup of the robot; start and faults of its scenario are left out.
    """
    scenario = setup.scenario.model_copy(update={"faults": (), "start": None})
    setup = setup.model_copy(update={"scenario": scenario})
    trajectory, template = _job(setup.vehicle)
    middle_m = trajectory.velocity_profile.parameters[-1].arc_length / 2.0
    first = _Rehearsal(setup)
    first.robot.load(trajectory, template)
    first.start(trajectory, template)
    first.run(lambda: first.robot.onboard.status.arc_length_m > middle_m)
    first.robot.inject_fault(parse_fault(_FAULT))
    first.pause_and_resume()
    checkpoint, ledger = first.robot.onboard.checkpoint, first.robot.work.ledger
    if checkpoint is None:  # it cannot even set off
        return
    second = _Rehearsal(setup)
    earlier = EarlierWork(first.robot.totals, ledger.rows(0)[: ledger.settled].copy())
    second.robot.load(trajectory, template, checkpoint, earlier)
    second.start(trajectory, template)
    second.run(lambda: not second.robot.active)


class _Rehearsal:
    """A throw-away robot and its telemetry."""

    def __init__(self, setup: Setup) -> None:
        self.robot = Emulator(setup.vehicle, setup.scenario, setup.onboard)
        self._telemetry = Telemetry(self.robot)
        self._runner = FastRunner(self.robot)

    def start(self, trajectory: Trajectory, template: Template) -> None:
        """Start the loaded job."""
        self._telemetry.loaded(trajectory, template)
        self._telemetry.restored_paint()
        self._telemetry.supplies()
        self.robot.start()

    def pause_and_resume(self) -> None:
        """Pause until the robot stands, and continue; one that cannot drive has paused by itself, and stays so."""
        with suppress(CommandRefused):
            self.robot.pause()
        self.run(lambda: self.robot.onboard.state == TraversalStatus.PAUSED and not self.robot.world.state.speed_mps)
        with suppress(CommandRefused):
            self.robot.resume()

    def run(self, until: Callable[[], bool]) -> None:
        """Run ticks, and pack their telemetry, until a condition is true."""
        last = self.robot.tick_count + _MOST_TICKS
        while not until() and self.robot.tick_count < last:
            self._telemetry.after(self._runner.step(self._telemetry.until_due(MOST_TICKS), self._telemetry.rows))


def _job(vehicle: Vehicle) -> tuple[Trajectory, Template]:
    """Make a straight from rest to rest; its middle is worked on if the vehicle has a tool."""
    drive, tool = vehicle.drive, vehicle.tool
    speed_mps = min(_SPEED_MPS, drive.transit_speed_mps)
    ramp_m = speed_mps**2 / drive.max_acceleration_mps2
    begin_m = ramp_m + _BEFORE_M
    end_m = begin_m + _WORK_M
    borders_m = (0.0, begin_m, end_m, end_m + ramp_m)
    switches = [(0.0, Actuation.NONE)]
    if tool.paints or tool.covers:
        switches += [(begin_m, Actuation.DISC_SPRAY), (end_m, Actuation.NONE)]
    trajectory = assemble(
        (
            segment(name, Curve(a, 0.0, 0.0, 0.0, b - a))
            for name, (a, b) in zip(("to", "work", "from"), pairwise(borders_m), strict=True)
        ),
        switches,
        (velocity(s, v) for s, v in zip(borders_m, (0.0, speed_mps, speed_mps, 0.0), strict=True)),
    )
    across_m = tool.point_m[1]
    if tool.covers:
        corners = ((begin_m, -1.0), (end_m, -1.0), (end_m, 1.0), (begin_m, 1.0))
        return trajectory, Template(name="rehearsal", areas=(Area(id="work", outline=corners),))
    line = LineSpec(start=(begin_m, across_m), end=(end_m, across_m))
    return trajectory, Template(name="rehearsal", segments=(TemplateSegment(id="work", line=line),))
