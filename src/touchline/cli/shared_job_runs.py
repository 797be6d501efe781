"""Jobs of several robots that share a template: option, checks, and the job from template to figures."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from touchline.cli.display import print_event, progress_bar, say, warn_of_left_out
from touchline.cli.garbage import without_collecting
from touchline.cli.job_bus import job_bus
from touchline.cli.job_terminal import Terminal, watch_team
from touchline.jobs.shared.team_order import TeamOrder
from touchline.jobs.watcher import JobFailed
from touchline.schemas import topics
from touchline.schemas.errors import SpecError
from touchline.schemas.messages import Event, PlanOptions
from touchline.schemas.roles import Role
from touchline.schemas.setup import Setup
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle

if TYPE_CHECKING:
    from touchline.jobs.shared.shared_job import Progress, SharedJob

MOST_ROBOTS: Final = 16

TeamOption = Annotated[
    int,
    typer.Option(
        "--robots",
        metavar="N",
        help="Number of robots that share the lines or areas; their seeds count up.",
        min=1,
        max=MOST_ROBOTS,
    ),
]


TakeOverOption = Annotated[
    float | None,
    typer.Option(
        "--take-over-after",
        metavar="S",
        help="With --robots: the others take over a failed robot's work after S seconds (wall clock), without an "
        "operator's `touchline order take-over`.",
        min=0.0,
        max=3600.0,
    ),
]


def check_team(vehicle: Vehicle) -> None:
    """Refuse a vehicle that has no work to share.

    Raises:
        SpecError: It has no tool.
    """
    if not (vehicle.tool.paints or vehicle.tool.covers):
        problem = f"is above 1, and {vehicle.name} neither paints nor covers ground"
        raise SpecError("command line", "--robots", problem, "share lines or areas among robots that have a tool")


@dataclass(frozen=True)
class TeamProducts:
    """Orders and products of a simulated shared job, besides its report.

    Attributes:
        orders: Scheduled orders of an operator; their outcomes are printed and reported.
        hashed: Whether to compute the hashes of the sessions.
        plot: Picture to draw, if any.
        record: File to record all robots to, if any.
    """

    orders: Sequence[TeamOrder] = ()
    hashed: bool = False
    plot: Path | None = None
    record: Path | None = None


@dataclass(frozen=True)
class TeamPace:
    """Pace and products of a shared job over the bus.

    Attributes:
        speed: Sim seconds per wall second, negative for as fast as possible.
        secure: Whether the bus is secured.
        take_over_after_s: Wall-clock time after which the others take over a failed robot's remaining work; None: when
            ordered.
        plot: Picture to draw, if any.
        record: File to record all robots to, if any.
    """

    speed: float
    secure: bool = False
    take_over_after_s: float | None = None
    plot: Path | None = None
    record: Path | None = None


def run_team(template: Template, setup: Setup, options: PlanOptions, robots: int, pace: TeamPace) -> dict[str, Any]:
    """Share a template among robots and carry it out over the bus, on a private system.

    Args:
        template: Lines or areas to share.
        setup: Setup of each robot; seeds count up.
        options: Planning options.
        robots: Number of robots.
        pace: Pace and products.

    Returns:
        The report, of all together and of each robot; when the job ended early, ``success`` false and the reason.

    Raises:
        PlanningError: The template cannot be shared.
    """
    from touchline.bus.secured_check import check_secured
    from touchline.jobs.shared.shared_bus_run import SharedBusRun
    from touchline.jobs.shared.shared_run_settings import SharedRunSettings
    from touchline.jobs.shared.team_picture import draw_team
    from touchline.jobs.shared.team_report import bus_figures
    from touchline.jobs.shared.work_evaluation import evaluate_work
    from touchline.supervision.running_system import only_one
    from touchline.supervision.secured_system import system_identities
    from touchline.supervision.temporary_system import ProcessOptions, local_system

    setups = {f"r{number + 1}": setup.with_seed(setup.scenario.seed + number) for number in range(robots)}
    config = job_bus(list(setups), secure=pace.secure)
    identities = system_identities(list(setups)) if pace.secure else {}
    operator = identities[Role.OPERATOR].name if pace.secure else ""
    with progress_bar("Touchline") as advance:
        job = _shared(template, options, setup.vehicle, robots, advance)
        recordings = pace.record.parent if pace.record else None  # no planner: plans are made here
        processes = ProcessOptions(apart=True, without=(topics.PLANNER,), recordings=recordings, identities=identities)
        with only_one(config), local_system(setups, config, processes) as system:
            advance(0.0, "Starting the services")
            system.wait_until_ready(say)
            if pace.secure:
                check_secured(system.bus.config.of(*setups), identities[Role.OBSERVER])
            settings = SharedRunSettings(
                pace.speed, pace.take_over_after_s, pace.record, config.endpoint, identity=operator
            )
            run = SharedBusRun(system.buses, job, settings, Terminal(advance, partial(watch_team, system)))
            try:
                run.run()
            except JobFailed as error:
                print_event(Event.ERROR, str(error))
                return {"success": False, "reason": str(error), "orders": run.orders, "recording": run.recording}
        advance(1.0, "Judging")
        work = evaluate_work(job, run.planned, [work for robot in run.robots for work in robot.works])
        figures = bus_figures(job, run, work)
        if pace.plot is not None:
            advance(1.0, "Drawing")
            draw_team(job, [robot.strokes for robot in run.robots], pace.plot, work.caption())
    return figures


def _shared(
    template: Template, options: PlanOptions, vehicle: Vehicle, robots: int, advance: "Progress"
) -> "SharedJob":
    """Return the template planned for robots that start where their plans begin.

    Raises:
        PlanningError: The template cannot be shared.
    """
    from touchline.jobs.shared.shared_areas import share_areas
    from touchline.jobs.shared.shared_job import share_reachable

    if vehicle.tool.covers:
        return share_areas(template, options, vehicle, [None] * robots, advance)
    job = share_reachable(template, options, vehicle, robots, advance)
    warn_of_left_out(job.left_out)
    return job


def simulate_team(
    template: Template, setup: Setup, options: PlanOptions, robots: int, products: TeamProducts
) -> dict[str, Any]:
    """Share a template among robots and carry it out in this process.

    Args:
        template: Lines or areas to share.
        setup: Setup of each robot; seeds count up.
        options: Planning options.
        robots: Number of robots.
        products: Orders and products.

    Returns:
        The report, of all together and of each robot.

    Raises:
        PlanningError: The template cannot be shared.
        SpecError: The picture cannot be written.
        RecordingError: The recording cannot be written.
    """
    from touchline.jobs.recording.payload_recorder import PayloadRecorder
    from touchline.jobs.shared.shared_simulation import names_of, simulate_shared
    from touchline.jobs.shared.team_picture import draw_team
    from touchline.jobs.shared.team_report import team_figures

    with progress_bar("Touchline") as advance:
        with without_collecting():
            job = _shared(template, options, setup.vehicle, robots, advance)
        setups = [setup.with_seed(setup.scenario.seed + number) for number in range(robots)]
        names = names_of(robots)
        with PayloadRecorder(products.record, names) as recorder, without_collecting():
            listener = recorder.hear if products.record is not None else None
            outcome = simulate_shared(job, setups, products.orders, advance, hashed=products.hashed, listener=listener)
        for taken in outcome.orders:
            text = f"{taken.order.at_s:g} s: r{taken.order.robot + 1} {taken.order.kind}: {taken.outcome}"
            print_event(Event.INFO if taken.done else Event.WARN, text)
        figures = team_figures(job, outcome, names) | recorder.as_figure()
        if products.plot is not None:
            advance(1.0, "Drawing")
            strokes = [[stroke for own in tasks for stroke in own.strokes] for tasks in outcome.robots]
            draw_team(job, strokes, products.plot, outcome.work.caption())
    return figures
