"""Several robots on one template: the option, what is refused, and the job from template to figures."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Final

import typer

from touchline.schemas.errors import SpecError
from touchline.schemas.messages import Event, PlanOptions
from touchline.schemas.setup import Setup
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.cli.display import print_event, progress_bar, say
from touchline.services.cli.garbage import without_collecting
from touchline.services.cli.job_terminal import Terminal, watch_system
from touchline.services.runs.bus_run import JobFailed
from touchline.services.runs.sharing.team_order import TeamOrder
from touchline.services.system.temporary_system import local_system

MOST_ROBOTS: Final = 16

TeamOption = Annotated[
    int,
    typer.Option(
        "--robots",
        metavar="N",
        help="So many robots share the lines and keep apart (docs/sharing.md); their seeds count up.",
        min=1,
        max=MOST_ROBOTS,
    ),
]


def check_team(vehicle: Vehicle, *, hashed: bool = False, record: Path | None = None) -> None:
    """Refuse what several robots cannot do together.

    Raises:
        SpecError: One of the options asks for it.
    """
    if not vehicle.tool.paints:
        problem = f"is above 1, and {vehicle.name} does not paint"
        raise SpecError("command line", "--robots", problem, "share lines among robots that paint them")
    if hashed:
        raise SpecError(
            "command line", "--hash", "is given with --robots", "a hash is of one robot's session: leave it out"
        )
    if record is not None:
        raise SpecError("command line", "--record", "is given with --robots", "leave it out: only reports are made")


def run_team(
    template: Template, setup: Setup, options: PlanOptions, robots: int, pace: tuple[float, Path | None]
) -> dict[str, Any]:
    """Share a template among robots, and have them carry it out over the bus, on a system of its own.

    Args:
        template: What to paint.
        setup: Of each robot, but for the seeds.
        options: How to plan.
        robots: How many.
        pace: Sim seconds per wall second, negative for as fast as it goes; and the picture to draw.

    Returns:
        The report, of all together and of each robot; when the job ended early, ``success`` false and the reason.

    Raises:
        PlanningError: It cannot be shared.
    """
    from touchline.services.runs.painted_picture import painted_caption
    from touchline.services.runs.sharing.joint_paint import paint_of_strokes
    from touchline.services.runs.sharing.shared_bus_run import SharedBusRun
    from touchline.services.runs.sharing.shared_job import share_job
    from touchline.services.runs.sharing.team_picture import draw_team
    from touchline.services.runs.sharing.team_report import bus_figures

    speed, plot = pace
    setups = {f"r{number + 1}": setup.with_seed(setup.scenario.seed + number) for number in range(robots)}
    with progress_bar("Touchline") as advance:
        job = share_job(template, options, setup.vehicle, [None] * robots, advance)
        with local_system(setups) as system:
            advance(0.0, "Starting the services")
            system.wait_until_ready(say)
            run = SharedBusRun(system.buses, job, speed, Terminal(advance, partial(watch_system, system)))
            try:
                run.run()
            except JobFailed as error:
                print_event(Event.ERROR, str(error))
                return {"success": False, "reason": str(error)}
        strokes = [stroke for own in run.strokes for stroke in own]
        figures = bus_figures(job, run, paint_of_strokes(template, setup.vehicle, strokes), list(setups))
        if plot is not None:
            advance(1.0, "Drawing")
            draw_team(job, run.strokes, plot, painted_caption(figures["paint"]))
    return figures


def simulate_team(
    template: Template,
    setup: Setup,
    options: PlanOptions,
    robots: int,
    plot: Path | None,
    orders: Sequence[TeamOrder] = (),
) -> dict[str, Any]:
    """Share a template among robots and have them carry it out in this process.

    Args:
        template: What to paint.
        setup: Of each robot, but for the seeds.
        options: How to plan.
        robots: How many.
        plot: The picture to draw, if any.
        orders: What an operator orders meanwhile; what comes of each is said, and reported.

    Returns:
        The report, of all together and of each robot.

    Raises:
        PlanningError: It cannot be shared.
        SpecError: The picture cannot be written.
    """
    from touchline.services.robot_sim.warm_up import warm_up
    from touchline.services.runs.painted_picture import painted_caption
    from touchline.services.runs.sharing.shared_job import share_job
    from touchline.services.runs.sharing.shared_simulation import simulate_shared
    from touchline.services.runs.sharing.team_picture import draw_team
    from touchline.services.runs.sharing.team_report import team_figures

    with progress_bar("Touchline") as advance:
        with without_collecting():
            job = share_job(template, options, setup.vehicle, [None] * robots, advance)
        warm_up(say, setup)
        setups = [setup.with_seed(setup.scenario.seed + number) for number in range(robots)]
        with without_collecting():
            outcome = simulate_shared(job, setups, orders, advance)
        for taken in outcome.orders:
            said = f"{taken.order.at_s:g} s: r{taken.order.robot + 1} {taken.order.kind}: {taken.outcome}"
            print_event(Event.INFO if taken.done else Event.WARN, said)
        figures = team_figures(job, outcome, [f"r{number + 1}" for number in range(robots)])
        if plot is not None:
            advance(1.0, "Drawing")
            strokes = [[stroke for own in tasks for stroke in own.strokes] for tasks in outcome.robots]
            draw_team(job, strokes, plot, painted_caption(figures["paint"]))
    return figures
