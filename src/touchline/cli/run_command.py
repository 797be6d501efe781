"""``touchline run``: one job from template to report, with real service processes."""

import time
from collections.abc import Iterator
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Final

import typer

from touchline.bus import Bus, BusConfig, Inbox, Sample
from touchline.bus.presence import Presence
from touchline.bus.secured_check import check_secured
from touchline.cli.choices import PlanChoice, SetupChoice, check_follower
from touchline.cli.display import print_event, progress_bar, say
from touchline.cli.groups import with_groups
from touchline.cli.job_terminal import Terminal, watch_system
from touchline.cli.options import SecureOption, SpeedOption, speed_factor
from touchline.cli.output_choice import OutputChoice
from touchline.cli.shared_job_runs import TakeOverOption, TeamOption, TeamPace, check_team, run_team
from touchline.cli.template_choice import TemplateChoice
from touchline.jobs.single.bus_run import BusRun, JobOptions
from touchline.jobs.watcher import JobFailed
from touchline.jobs.way_round.way_round_run import WayRoundRun
from touchline.jobs.way_round.work_done import draw_work_done
from touchline.schemas import topics
from touchline.schemas.catalogue import parse_template
from touchline.schemas.digest import scenario_hash
from touchline.schemas.errors import SpecError, TouchlineError
from touchline.schemas.messages import GetDiagnosticsRequest, GetPaintRequest, PlanOptions, String
from touchline.schemas.messages.base import Message
from touchline.schemas.plugins import ASKED
from touchline.schemas.roles import Role
from touchline.schemas.setup import Setup
from touchline.schemas.spec import parse
from touchline.schemas.template import Template
from touchline.schemas.topics import DEFAULT_NAMESPACE
from touchline.services.robot_sim.way_round.way_round_job import goes_round
from touchline.supervision.running_system import only_one
from touchline.supervision.secured_system import system_identities
from touchline.supervision.temporary_system import ProcessOptions, local_system

#: A robot that answers has published its setup long before.
_SETUP_S: Final = 5.0


def register(app: typer.Typer) -> None:
    """Add the subcommand to `app`."""
    app.command("run")(with_groups(run))


def run(
    drawing: TemplateChoice,
    robot: SetupChoice,
    planning: PlanChoice,
    speed: SpeedOption = "max",
    name: Annotated[
        str | None,
        typer.Option(
            "--robot",
            metavar="NAME",
            help="Use this robot of the system on the bus (see `touchline status`), instead of starting one for it.",
        ),
    ] = None,
    robots: TeamOption = 1,
    take_over_after: TakeOverOption = None,
    secure: SecureOption = False,
    *,
    output: OutputChoice,
) -> None:
    """Start planner, robot and bridge, carry out a template once over Zenoh, stop them, and report."""
    template = drawing.chosen()
    if secure and name is not None:
        remedy = "leave it out: the robot on the bus is secured if its system is"
        raise SpecError("command line", "--secure", "is given with --robot", remedy)
    if robots > 1:
        if name is not None:
            raise SpecError("command line", "--robot", "is given with --robots", "give one of them")
        setup = robot.chosen().at(template.origin)
        check_follower(setup.onboard)
        check_team(setup.vehicle)
        pace = TeamPace(speed_factor(speed), secure, take_over_after, output.plot, output.record)
        figures = run_team(template, setup, planning.options(), robots, pace)
        output.conclude("Run", drawing.template, setup, figures)
        return
    if take_over_after is not None:
        problem = "is given without --robots"
        raise SpecError("command line", "--take-over-after", problem, "give --robots 2 or more, too")
    if name is not None:
        robot.refuse_with("--robot", "leave it out: the robot on the bus has its own setup")
        config = BusConfig.from_environment([name])
        setup, figures = run_on_bus(template, config, speed_factor(speed), planning.options(), output)
    else:
        setup = robot.chosen()
        figures = run_job(
            template,
            speed=speed_factor(speed),
            setup=setup,
            options=planning.options(),
            record=output.record,
            plot=output.plot,
            secure=secure,
        )
    output.conclude("Run", drawing.template, setup, figures)


def run_job(
    template: Template,
    *,
    speed: float,
    setup: Setup,
    options: PlanOptions,
    record: Path | None,
    plot: Path | None = None,
    secure: bool = False,
) -> dict[str, Any]:
    """Start a private system, do one job, stop it.

    The robot's map frame is the template's: its geodetic origin, if any, becomes the scenario's.

    Returns:
        The run report; when the job ended early, ``success`` false and the reason.
    """
    begun = time.monotonic()
    setup = setup.at(template.origin)
    cause = scenario_hash(setup, template, options)
    job_options = JobOptions(template.to_json(), options, speed, record, cause, setup.vehicle)
    # A private bus, so that several can run at once; but an external follower could not find that.
    config = BusConfig.from_environment() if setup.onboard.follower in ASKED else None
    namespace = config.namespace if config else DEFAULT_NAMESPACE
    identities = system_identities([namespace]) if secure else {}
    with (
        only_one(config) if config else nullcontext(),
        local_system(
            {namespace: setup},
            config,
            ProcessOptions(recordings=record.parent if record else None, identities=identities),
        ) as system,
        progress_bar("Touchline") as advance,
    ):
        advance(0.0, "Starting the services")
        system.wait_until_ready(say)
        if secure:
            check_secured(system.bus.config, identities[Role.OBSERVER])
        terminal = Terminal(advance, partial(watch_system, system))
        return _do(_job(template, system.bus, job_options, terminal), begun, plot)


def run_on_bus(
    template: Template, config: BusConfig, speed: float, options: PlanOptions, output: OutputChoice
) -> tuple[Setup, dict[str, Any]]:
    """Do one job with the robot of ``config`` on the bus, and leave it running.

    Returns:
        The setup that the robot publishes, and the run report.

    Raises:
        CallError: There is no such robot.
    """
    with Bus.open(topics.OPERATOR, config) as bus, progress_bar(f"Touchline, {config.namespace}") as advance:
        begun = time.monotonic()
        presence = bus.presence()
        # Do not wait for a robot that does not answer: the error names those that are there.
        bus.call(topics.diagnostics_service(topics.ROBOT_SIM), GetDiagnosticsRequest())
        setup = setup_of(bus)
        cause = scenario_hash(setup, template, options)
        job_options = JobOptions(template.to_json(), options, speed, output.record, cause, setup.vehicle)
        job = _job(template, bus, job_options, Terminal(advance, partial(watch_robot, presence, config.namespace)))
        return setup, _do(job, begun, output.plot)


def setup_of(bus: Bus) -> Setup:
    """Return the robot's setup, a latched topic.

    Raises:
        TouchlineError: The robot does not publish it.
    """
    for _, message in _messages(bus.inbox([topics.SETUP], keep="latest")):
        if isinstance(message, String):
            return parse(Setup, message.data, f"the setup of {bus.namespace}", recorded=True)
    raise TouchlineError(f"robot {bus.namespace} has not published its setup within {_SETUP_S:.0f} s")


def _messages(inbox: Inbox) -> Iterator[tuple[Sample, Message]]:
    deadline = time.monotonic() + _SETUP_S
    while time.monotonic() < deadline:
        yield from inbox.messages()
        time.sleep(0.005)


def watch_robot(presence: Presence, name: str) -> None:
    """Check that the robot of that name is still on the bus.

    Raises:
        JobFailed: It has left the bus.
    """
    for change in presence.poll():
        if change.node == topics.ROBOT_SIM and not change.alive:
            remedy = "back again, `touchline order resume`; restarted, `touchline order go-on`"
            raise JobFailed(f"robot {name} has left the bus; {remedy}")


def _job(template: Template, bus: Bus, options: JobOptions, terminal: Terminal) -> BusRun:
    """Return the job, of several drives if the robot goes round things."""
    return (WayRoundRun if goes_round(options.vehicle, template) else BusRun)(bus, options, terminal)


def _do(job: BusRun, begun_s: float, plot: Path | None) -> dict[str, Any]:
    """Do the job and draw it; return the run report, or why the job ended early."""
    try:
        figures = job.run()
    except JobFailed as error:
        print_event(2, str(error))
        return {"success": False, "reason": str(error)}
    first_motion_s = job.started_at - begun_s
    if plot is not None:
        job.watcher.stage("Drawing")
        _draw(job, plot)
    return {**figures, "first_motion_s": first_motion_s}


def _draw(job: BusRun, path: Path) -> None:
    from touchline.jobs.single.work_picture import draw_work

    if isinstance(job, WayRoundRun) and job.work is not None:
        draw_work_done(job.work, job.strokes, path)
        return
    strokes = job.bus.call(topics.GET_PAINT, GetPaintRequest(), timeout_s=30.0).strokes
    template = parse_template(job.options.template_json)
    draw_work(template, strokes, path, job.report, job.area)
