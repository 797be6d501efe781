"""``touchline planner|robot-sim|bridge|tui``: each process alone."""

import json
from pathlib import Path
from typing import Annotated

import typer

from schemas.scenario import Scenario
from schemas.spec import parse, read_text
from services.cli.drawing import OriginOption, parse_origin
from services.cli.options import (
    Follower,
    Noise,
    SupervisedOption,
    speed_factor,
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
    scenario: Annotated[Path | None, typer.Option(help="Scenario JSON file.", show_default=False)] = None,
    seed: Annotated[int | None, typer.Option(help="Seed, instead of the scenario's.", min=0)] = None,
    follower: Annotated[Follower | None, typer.Option(help="Follower, instead of the scenario's.")] = None,
    noise: Annotated[Noise | None, typer.Option(help="Noise profile, instead of the scenario's.")] = None,
    origin: OriginOption = None,
    speed: Annotated[str, typer.Option(help="Times real time, or `max`; can be changed while it runs.")] = "1",
    supervised: SupervisedOption = False,
) -> None:
    """Run the emulated robot: waits on the bus for a trajectory and drives it, until Ctrl-C."""
    from services.robot_sim.service import run_service

    changes = {
        "seed": seed,
        "follower": follower and follower.value,
        "noise": noise and noise.value,
        "origin": origin and parse_origin(origin, "--origin"),
    }
    text = read_text(scenario) if scenario else "{}"
    given = parse(Scenario, text, scenario.name if scenario else "scenario")
    chosen = given.model_copy(update={name: value for name, value in changes.items() if value is not None})
    run_service(scenario=chosen, speed=speed_factor(speed), supervised=supervised)


def bridge(
    record: Annotated[Path | None, typer.Option(help="Record to this MCAP file from the start.")] = None,
    supervised: SupervisedOption = False,
) -> None:
    """Run the bridge: records the bus to MCAP on request, until Ctrl-C."""
    from services.bridge.service import run_service

    report = run_service(record, supervised=supervised)
    if report is not None:
        typer.echo(json.dumps({"path": str(report.path), "messages": report.messages, "lost": report.lost}))


def tui() -> None:
    """Open the operator's console on the bus; services may come and go while it is open."""
    from tui.console import run_console

    run_console()
