"""``touchline planner|robot-sim|bridge|coordinator|router|tui``: single processes."""

import logging
import sys
import time
from pathlib import Path
from typing import Annotated

import typer

from touchline.bus import BusConfig
from touchline.bus.config import named_robots
from touchline.cli.choices import SetupChoice, VehicleChoice
from touchline.cli.display import print_json
from touchline.cli.foxglove_choice import FoxgloveChoice
from touchline.cli.groups import with_groups
from touchline.cli.options import (
    LogsOption,
    RecordingsOption,
    RobotsOption,
    SomeRobotsOption,
    SupervisorOption,
    speed_factor,
)
from touchline.cli.ros2_choice import Ros2Choice
from touchline.cli.template_choice import OriginOption, parse_origin
from touchline.recordings.writing import check_recordable
from touchline.schemas import topics
from touchline.schemas.errors import SpecError, TouchlineError
from touchline.schemas.fleet import Fleet
from touchline.schemas.spec import parse, read_text
from touchline.schemas.team import TeamScenario
from touchline.supervision.priority import FIRST, SOON, run_at, switch_threads_soon
from touchline.supervision.service_log import service_log

_LOOK_S = 0.1


def register(app: typer.Typer) -> None:
    """Add the subcommands to `app`."""
    app.command("planner")(with_groups(planner))
    app.command("robot-sim")(with_groups(robot_sim))
    app.command("bridge")(with_groups(bridge))
    app.command("coordinator")(coordinator)
    app.command("router")(router)
    app.command("tui")(tui)


def planner(
    body: VehicleChoice, fleet: RobotsOption = None, logs: LogsOption = None, supervisor: SupervisorOption = None
) -> None:
    """Run the planner: answers plan requests on the bus until Ctrl-C."""
    from touchline.services.planner.service import run_service

    if fleet is None:
        vehicles = [body.chosen()]
    elif body.vehicle is not None:
        raise SpecError("command line", "--vehicle", "is given with --robots", f"set it for each robot in {fleet.name}")
    else:
        vehicles = [setup.vehicle for setup in Fleet.read(fleet).setups().values()]
    config = BusConfig.from_environment()
    with service_log(topics.PLANNER, config.namespaces, logs):
        run_service(config, vehicles, supervisor=supervisor)


def robot_sim(
    robot: SetupChoice,
    fleet: RobotsOption = None,
    origin: OriginOption = None,
    speed: Annotated[
        str, typer.Option(metavar="FACTOR", help="Pace, × real time, or `max`; can be changed while it runs.")
    ] = "1",
    journal: Annotated[
        Path | None,
        typer.Option(
            metavar="PLACE",
            help="Journal, from which a restart continues: a file, or a folder for several robots "
            "(default: in the user's state folder).",
        ),
    ] = None,
    logs: LogsOption = None,
    supervisor: SupervisorOption = None,
) -> None:
    """Run one or several emulated robots: they wait on the bus for trajectories and drive them, until Ctrl-C."""
    from touchline.services.robot_sim.service import run_service

    here = None if origin is None else parse_origin(origin, "--origin")
    config = BusConfig.from_environment()
    robots = {name: setup.at(here) for name, setup in robot.chosen_robots(fleet, config.namespaces).items()}
    pace = speed_factor(speed)
    with service_log(topics.ROBOT_SIM, tuple(robots), logs):
        run_service(robots, config, speed=pace, journal=journal, supervisor=supervisor)


def bridge(
    ros: Ros2Choice,
    viewers: FoxgloveChoice,
    record: Annotated[
        Path | None, typer.Option(metavar="FILE.mcap", help="Record to this MCAP file from the start.")
    ] = None,
    recordings: RecordingsOption = None,
    logs: LogsOption = None,
    supervisor: SupervisorOption = None,
) -> None:
    """Run the bridge until Ctrl-C: records the bus to MCAP on request, serves ROS 2 nodes and viewers."""
    from touchline.services.bridge.service import run_service

    check_recordable(record)
    config = BusConfig.from_environment()
    with service_log(topics.BRIDGE, config.namespaces, logs):
        report = run_service(
            record,
            config,
            recordings=recordings,
            ros2=viewers.with_clock(ros.gateway()),
            foxglove=viewers.server(),
            supervisor=supervisor,
        )
    if report is not None:
        figures = {"path": str(report.path), "messages": report.messages, "lost": report.lost}
        print_json(figures | ({"problem": report.problem} if report.problem else {}), None)


def coordinator(
    team: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="JSON file of the team (docs/reference/teams.md; default: tb1 to tb10)."),
    ] = None,
    lockstep: Annotated[
        bool, typer.Option("--lockstep", help="Reproducible: sim time of emulated robots waits for the coordinator.")
    ] = False,
    standby: Annotated[
        bool, typer.Option("--standby", help="Wait until the coordinator is lost, and take over.")
    ] = False,
    logs: LogsOption = None,
    supervisor: SupervisorOption = None,
) -> None:
    """Run a team's coordinator on the bus: it acts from the first task on, until Ctrl-C."""
    from touchline.services.coordinator.service import run_service

    scenario = parse(TeamScenario, read_text(team), team.name) if team is not None else TeamScenario()
    with service_log(topics.COORDINATOR, (topics.TEAM_NAMESPACE,), logs):
        run_service(scenario, lockstep=lockstep, standby=standby, supervisor=supervisor)


def router(logs: LogsOption = None, supervisor: SupervisorOption = None) -> None:
    """Run the router of a bus that spans several machines, at $TOUCHLINE_ENDPOINT, until Ctrl-C."""
    from touchline.bus.router import open_router
    from touchline.supervision.shutdown import until_stopped

    config = BusConfig.from_environment()
    run_at(FIRST)  # every stop of its bus passes here
    with service_log("router", (), logs), until_stopped(supervisor) as stop, open_router(config, alone=True) as poll:
        logging.getLogger(__name__).info("listens on %s", config.endpoint)
        while not stop:
            poll()
            time.sleep(_LOOK_S)


def tui(robot: SomeRobotsOption = None) -> None:
    """Open the operator's console for every robot on the bus; services may come and go meanwhile."""
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        raise TouchlineError("the console needs a terminal; without one, use `touchline run` and `touchline status`")
    from touchline.tui.console import run_console

    run_at(SOON)
    switch_threads_soon()
    run_console(BusConfig.from_environment(robot or ()), everyone=not (robot or named_robots()))
