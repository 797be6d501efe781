"""``touchline goto``: drive an emulated robot, or the one on the bus, to a pose."""

import math
import sys
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer
from pydantic import ValidationError

from touchline.cli.choices import SetupChoice, check_follower
from touchline.cli.display import print_event, progress_bar
from touchline.cli.groups import with_groups
from touchline.cli.job_terminal import Terminal
from touchline.cli.number_list import numbers_of
from touchline.cli.options import ExitCode, JsonOption, ReportOption, RobotOption, check_plot, config_of
from touchline.cli.output_choice import deliver
from touchline.cli.plugin_option import PluginOption
from touchline.jobs.watcher import JobFailed
from touchline.recordings.writing import check_recordable, check_writable
from touchline.schemas import topics
from touchline.schemas.errors import SpecError
from touchline.schemas.given_angles import given_angle
from touchline.schemas.known_ground import OPEN_GROUND, KnownGround
from touchline.schemas.messages import Event, PlanOptions, PoseGoal
from touchline.schemas.plugins import POSE_METHODS, SPEED_LAWS
from touchline.schemas.scenario import Pose2
from touchline.schemas.setup import Setup
from touchline.schemas.spec import problems_of

if TYPE_CHECKING:  # an emulated robot is driven without Zenoh
    from touchline.bus import BusConfig


def register(app: typer.Typer) -> None:
    """Add the subcommand; what looks like an unknown option is a negative number."""
    app.command("goto", context_settings={"ignore_unknown_options": True})(with_groups(goto))


@dataclass(frozen=True)
class GoalChoice:
    """Goal, path method and timing."""

    x: Annotated[float, typer.Argument(metavar="X", help="x of the goal, m, map frame.")]
    y: Annotated[float, typer.Argument(metavar="Y", help="y of the goal, m, map frame.")]
    heading: Annotated[
        float | None,
        typer.Argument(metavar="HEADING", help="Heading at the goal, rad, counter-clockwise from +x (default: any)."),
    ] = None
    method: Annotated[str | None, PluginOption("--method", POSE_METHODS, "METHOD", "Path method")] = None
    law: Annotated[str | None, PluginOption("--law", SPEED_LAWS, "LAW", "Speed law along the path")] = None
    duration: Annotated[
        float, typer.Option(metavar="S", help="Duration of the drive, s (0: as fast as the law allows).")
    ] = 0.0
    tangents: Annotated[
        str | None,
        typer.Option(
            "--k",
            metavar="M[,M]",
            help="Method cubic: tangent lengths at start and goal, m; negative: backward (default: chosen).",
        ),
    ] = None
    forward_only: Annotated[
        bool, typer.Option("--forward-only", help="Drive forward only: neither reverse nor turn on the spot.")
    ] = False

    field: Annotated[
        str | None,
        typer.Option(
            metavar="TEMPLATE|MAP.yaml",
            help="Keep inside the boundary and off the obstacles of a template, or of a map of Nav2.",
        ),
    ] = None
    margin: Annotated[
        float, typer.Option(metavar="M", min=0.0, max=1.0, help="With --field: distance that the body keeps, m.")
    ] = 0.05

    def goal(self) -> PoseGoal:
        """Return the pose to drive to.

        Raises:
            SpecError: The heading is not an angle, or a tangent length not a number.
        """
        return PoseGoal(
            x_m=self.x,
            y_m=self.y,
            heading_rad=math.nan if self.heading is None else given_angle("HEADING", self.heading),
            method=self.method or "",
            law=self.law or "",
            duration_s=self.duration,
            tangents_m=np.array(numbers_of("--k", self.tangents, (1, 2), "1.5 or 1.5,2") if self.tangents else []),
        )

    def options(self) -> PlanOptions:
        """Return the planning options."""
        return PlanOptions(forward_only=self.forward_only, margin_m=self.margin)

    def ground(self) -> KnownGround:
        """Return the known ground.

        Raises:
            SpecError: The field cannot be read.
        """
        if self.field is None:
            return OPEN_GROUND
        from touchline.jobs.goal.known_field import load_ground

        return load_ground(self.field)


def goto(
    goal: GoalChoice,
    robot: SetupChoice,
    start: Annotated[
        str | None,
        typer.Option(
            metavar="X,Y,HEADING", help="With --vehicle: start pose (m, m, rad; default: the scenario's, or 0,0,0)."
        ),
    ] = None,
    name: RobotOption = None,
    hashed: Annotated[bool, typer.Option("--hash", help="With --vehicle: compute the session hash.")] = False,
    record: Annotated[
        Path | None, typer.Option(metavar="FILE.mcap", help="With --vehicle: record the session to this file.")
    ] = None,
    plot: Annotated[
        Path | None, typer.Option(metavar="FILE", help="With --vehicle: draw the way to this file (.svg, .png, .pdf).")
    ] = None,
    report: ReportOption = None,
    as_json: JsonOption = False,
) -> None:
    """Drive to a pose: with --vehicle an emulated robot in this process, without it the robot on the bus.

    Reports where and when it arrived; exit code 1 if it did not come to rest within 5 cm and 2° of the goal. The robot
    on the bus starts from where it stands or drives; Ctrl-C brakes it and aborts the goal.
    """
    check_recordable(record)
    check_writable(report)
    check_plot(plot)
    goal.goal()  # an invalid goal is refused before anything starts
    if robot.vehicle is not None:
        if name is not None:
            raise SpecError("command line", "--robot", f"is {name}, and --vehicle is given, too", "give one of them")
        figures = emulated(_standing_at(robot.chosen(), start), goal, hashed, record, plot)
    else:
        _refuse_for_bus(robot, {"--start": start, "--hash": hashed or None, "--record": record, "--plot": plot})
        figures = on_bus(config_of(name), goal)
    deliver("Drive to the goal", figures, report, as_json)
    if not figures["success"]:
        sys.exit(ExitCode.FAILED)


def emulated(setup: Setup, goal: GoalChoice, hashed: bool, record: Path | None, plot: Path | None) -> dict[str, Any]:
    """Drive a robot of this setup to the goal in this process; return its figures."""
    from touchline.jobs.goal.goal_simulation import drive_to_goal
    from touchline.jobs.single.simulation import Products

    check_follower(setup.onboard)
    ground = goal.ground()
    with progress_bar("Touchline") as advance:
        done = drive_to_goal(setup, goal.goal(), goal.options(), Products(hashed, record), advance, ground)
    if plot is not None:
        from touchline.services.planner.plots.way_picture import plot_way

        plot_way(done.plan, ground, setup.vehicle, plot)
    return {
        **done.figures(),
        "vehicle": setup.vehicle.name,
        "seed": setup.scenario.seed,
        "follower": setup.onboard.follower,
        "noise": setup.scenario.noise,
    }


def on_bus(config: "BusConfig", goal: GoalChoice) -> dict[str, Any]:
    """Drive the robot on the bus to the goal; return whether it arrived, or why not.

    Raises:
        CallError: There is no such robot.
    """
    from touchline.bus import Bus
    from touchline.cli.run_command import watch_robot
    from touchline.jobs.goal.goal_on_bus import GoalOnBus

    ground = goal.ground()
    ground_json = "" if ground == OPEN_GROUND else ground.model_dump_json()
    with Bus.open(topics.OPERATOR, config) as bus, progress_bar(f"Touchline, {config.namespace}") as advance:
        terminal = Terminal(advance, partial(watch_robot, bus.presence(), config.namespace))
        try:
            return GoalOnBus(bus, goal.goal(), goal.options(), terminal, ground_json).run()
        except JobFailed as error:
            print_event(Event.ERROR, str(error))
            return {"success": False, "reason": str(error)}


def _standing_at(setup: Setup, start: str | None) -> Setup:
    """Return the setup with the robot at --start, else where the scenario puts it, else at 0,0,0.

    Raises:
        SpecError: --start is not a pose.
    """
    if start is None:
        pose = setup.scenario.standing()
    else:
        x_m, y_m, heading_rad = numbers_of("--start", start, (3,), "0,0,0")
        data = {"x_m": x_m, "y_m": y_m, "heading_rad": given_angle("--start", heading_rad)}
        try:
            pose = Pose2.model_validate(data)
        except ValidationError as error:
            raise problems_of(error, "--start", data, Pose2) from error
    return setup.model_copy(update={"scenario": setup.scenario.model_copy(update={"start": pose})})


def _refuse_for_bus(robot: SetupChoice, others: dict[str, object]) -> None:
    """Refuse options that only an emulated robot has.

    Raises:
        SpecError: One of them is given.
    """
    problem, remedy = "but the robot on the bus has its own", "leave it out, or give --vehicle"
    robot.refuse(problem, remedy)
    for option, value in others.items():
        if value is not None:
            raise SpecError("command line", option, f"is {value}, {problem}", remedy)
