"""``touchline planner|robot-sim|bridge|tui``: each process alone."""

import json
from pathlib import Path
from typing import Annotated

import typer

from services.cli.drawing import OriginOption, parse_origin
from services.cli.options import (
    FollowerOption,
    NoiseOption,
    ScenarioOption,
    SeedOption,
    SupervisedOption,
    chosen_scenario,
    speed_factor,
)
from services.cli.ros2 import (
    Ros2ConnectOption,
    Ros2ListenOption,
    Ros2Option,
    RosDomainOption,
    RosNamespaceOption,
    gateway_config,
)


def register(app: typer.Typer) -> None:
    """Add the subcommands."""
    app.command("planner")(planner)
    app.command("robot-sim")(robot_sim)
    app.command("bridge")(bridge)
    app.command("tui")(tui)


def planner(supervised: SupervisedOption = False) -> None:
    """Run the planner: answers plan requests on the bus until Ctrl-C."""
    from services.planner.service import run_service

    run_service(supervised=supervised)


def robot_sim(
    scenario: ScenarioOption = None,
    seed: SeedOption = None,
    follower: FollowerOption = None,
    noise: NoiseOption = None,
    origin: OriginOption = None,
    speed: Annotated[str, typer.Option(help="Times real time, or `max`; can be changed while it runs.")] = "1",
    supervised: SupervisedOption = False,
) -> None:
    """Run the emulated robot: waits on the bus for a trajectory and drives it, until Ctrl-C."""
    from services.robot_sim.service import run_service

    chosen = chosen_scenario(scenario, seed, follower, noise)
    if origin is not None:
        chosen = chosen.model_copy(update={"origin": parse_origin(origin, "--origin")})
    run_service(scenario=chosen, speed=speed_factor(speed), supervised=supervised)


def bridge(
    record: Annotated[Path | None, typer.Option(help="Record to this MCAP file from the start.")] = None,
    ros2: Ros2Option = False,
    ros_domain: RosDomainOption = 0,
    ros_namespace: RosNamespaceOption = "",
    ros2_listen: Ros2ListenOption = "",
    ros2_connect: Ros2ConnectOption = "",
    supervised: SupervisedOption = False,
) -> None:
    """Run the bridge, until Ctrl-C: records the bus to MCAP on request, and with --ros2 shows the robot to ROS 2."""
    from services.bridge.service import run_service

    gateway = gateway_config(ros2, ros_domain, ros_namespace, ros2_listen, ros2_connect)
    report = run_service(record, ros2=gateway, supervised=supervised)
    if report is not None:
        typer.echo(json.dumps({"path": str(report.path), "messages": report.messages, "lost": report.lost}))


def tui() -> None:
    """Open the operator's console on the bus; services may come and go while it is open."""
    from tui.console import run_console

    run_console()
