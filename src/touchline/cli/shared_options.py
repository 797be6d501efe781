"""Several robots on one template: the option, what is refused, and the job from template to figures."""

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
from touchline.schemas.setup import Setup
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.supervision.running_system import only_one
from touchline.supervision.temporary_system import ProcessOptions, local_system

if TYPE_CHECKING:
    from touchline.jobs.shared.shared_job import Progress, SharedJob

MOST_ROBOTS: Final = 16

TeamOption = Annotated[
    int,
    typer.Option(
        "--robots",
        metavar="N",
        help="So many robots share the lines, or areas, and keep apart (docs/sharing.md); their seeds count up.",
        min=1,
        max=MOST_ROBOTS,
    ),
]


TakeOverOption = Annotated[
    float | None,
    typer.Option(
        "--take-over-after",
        metavar="S",
        help="With --robots: S seconds (wall clock) after one has failed the others do what it has left, without an "
        "operator's `touchline order take-over`.",
        min=0.0,
        max=3600.0,
        show_default=False,
    ),
]


def check_team(vehicle: Vehicle) -> None:
    """Refuse a vehicle that has nothing to share with others.

    Raises:
        SpecError: It has no tool.
    """
    if not (vehicle.tool.paints or vehicle.tool.covers):
        problem = f"is above 1, and {vehicle.name} neither paints nor covers ground"
        raise SpecError("command line", "--robots", problem, "share lines or areas among robots that have a tool")


@dataclass(frozen=True)
class TeamProducts:
    """What happens in a simulated job of several robots, and what comes of it besides its report.

    Attributes:
        orders: What an operator orders meanwhile; what comes of each is said, and reported.
        hashed: Whether to work out the hashes of the sessions.
        plot: The picture to draw, if any.
        record: The file to record all robots to, if any.
    """

    orders: Sequence[TeamOrder] = ()
    hashed: bool = False
    plot: Path | None = None
    record: Path | None = None


@dataclass(frozen=True)
class TeamPace:
    """How a job of several robots over the bus goes on.

    Attributes:
        speed: Sim seconds per wall second, negative for as fast as it goes.
        take_over_after_s: Wall clock after which the others do what one that has failed has left; None: when ordered.
        plot: The picture to draw, if any.
        record: The file to record all robots to, if any.
    """

    speed: float
    take_over_after_s: float | None = None
    plot: Path | None = None
    record: Path | None = None


def run_team(template: Template, setup: Setup, options: PlanOptions, robots: int, pace: TeamPace) -> dict[str, Any]:
    """Share a template among robots, and have them carry it out over the bus, on a system of its own.

    Args:
        template: What to paint.
        setup: Of each robot, but for the seeds.
        options: How to plan.
        robots: How many.
        pace: How it goes on.

    Returns:
        The report, of all together and of each robot; when the job ended early, ``success`` false and the reason.

    Raises:
        PlanningError: It cannot be shared.
    """
    from touchline.jobs.shared.conduct import Conduct
    from touchline.jobs.shared.judged import judged
    from touchline.jobs.shared.shared_bus_run import SharedBusRun
    from touchline.jobs.shared.team_picture import draw_team
    from touchline.jobs.shared.team_report import bus_figures

    setups = {f"r{number + 1}": setup.with_seed(setup.scenario.seed + number) for number in range(robots)}
    with progress_bar("Touchline") as advance:
        job = _shared(template, options, setup.vehicle, robots, advance)
        config = job_bus(list(setups))
        recordings = pace.record.parent if pace.record else None  # plans are made here
        processes = ProcessOptions(apart=True, without=(topics.PLANNER,), recordings=recordings)
        with only_one(config), local_system(setups, config, processes) as system:
            advance(0.0, "Starting the services")
            system.wait_until_ready(say)
            conduct = Conduct(pace.speed, pace.take_over_after_s, pace.record, config.endpoint)
            run = SharedBusRun(system.buses, job, conduct, Terminal(advance, partial(watch_team, system)))
            try:
                run.run()
            except JobFailed as error:
                print_event(Event.ERROR, str(error))
                return {"success": False, "reason": str(error), "orders": run.orders, "recording": run.recording}
        advance(1.0, "Judging")
        work = judged(job, run.planned, [work for robot in run.robots for work in robot.works])
        figures = bus_figures(job, run, work)
        if pace.plot is not None:
            advance(1.0, "Drawing")
            draw_team(job, [robot.strokes for robot in run.robots], pace.plot, work.caption())
    return figures


def _shared(
    template: Template, options: PlanOptions, vehicle: Vehicle, robots: int, advance: "Progress"
) -> "SharedJob":
    """The template planned for robots that are carried to where their plans begin.

    Raises:
        PlanningError: It cannot be shared.
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
    """Share a template among robots and have them carry it out in this process.

    Args:
        template: What to paint, or to cover.
        setup: Of each robot, but for the seeds.
        options: How to plan.
        robots: How many.
        products: What happens, and what is to come of it.

    Returns:
        The report, of all together and of each robot.

    Raises:
        PlanningError: It cannot be shared.
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
            said = f"{taken.order.at_s:g} s: r{taken.order.robot + 1} {taken.order.kind}: {taken.outcome}"
            print_event(Event.INFO if taken.done else Event.WARN, said)
        figures = team_figures(job, outcome, names) | recorder.as_figure()
        if products.plot is not None:
            advance(1.0, "Drawing")
            strokes = [[stroke for own in tasks for stroke in own.strokes] for tasks in outcome.robots]
            draw_team(job, strokes, products.plot, outcome.work.caption())
    return figures
