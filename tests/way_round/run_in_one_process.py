"""A whole job over the bus, with robot and planner in this process: they run whenever the job waits for them."""

from typing import Any, Final

from tests.robot_sim.bus_rig import AtOnce
from touchline.bus import Bus, BusConfig, HealthReporter
from touchline.jobs.single.bus_run import JobOptions
from touchline.jobs.way_round.way_round_run import WayRoundRun
from touchline.schemas import topics
from touchline.schemas.messages import PlanOptions
from touchline.schemas.setup import Setup
from touchline.schemas.template import Template
from touchline.services.planner.request import answer
from touchline.services.robot_sim.robot_process import RobotProcess

TURNS: Final = 5
"""Turns of the robot a moment; the job sleeps in between."""


class Hosted:
    """Watcher that runs robot and planner.

    Attributes:
        told: Texts of all events.
    """

    def __init__(self, robot: RobotProcess, planner: Bus, setup: Setup) -> None:
        self._robot, self._setup, self._server = robot, setup, planner.serve(topics.PLAN_SERVICE)
        self.told = list[str]()

    def stage(self, text: str) -> None:
        """See `Watcher`."""

    def progress(self, fraction: float, text: str) -> None:
        """See `Watcher`."""

    def event(self, severity: int, text: str) -> None:
        """See `Watcher`."""
        self.told.append(text)

    def check(self) -> None:
        """Run both for a moment."""
        for _ in range(TURNS):
            self._robot.turn()
        if (call := self._server.poll()) is not None:
            call.reply(answer(call.request, self._setup.vehicle))


class HostedRun(WayRoundRun):
    """Run without diagnostics, for which nobody answers."""

    def _bus_figures(self) -> dict[str, int]:
        return {}


def run_in_one_process(
    template: Template, options: PlanOptions, setup: Setup, config: BusConfig
) -> tuple[HostedRun, dict[str, Any], list[str]]:
    """Do a job; return the run, its report, and the texts of all events."""
    with (
        Bus.open(topics.ROBOT_SIM, config) as bus,
        Bus.open(topics.PLANNER, config) as planner,
        Bus.open(topics.OPERATOR, config) as operator,
    ):
        robot = RobotProcess(bus, HealthReporter(bus), setup, AtOnce(bus), speed=-1.0, clock="held", journal=None)
        host = Hosted(robot, planner, setup)
        run = HostedRun(operator, JobOptions(template.to_json(), options, -1.0, None, vehicle=setup.vehicle), host)
        return run, run.run(), host.told
