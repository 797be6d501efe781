"""``touchline simulate``: one job in this process, without services, as fast as possible."""

from typing import Annotated

import typer

from touchline.cli.choices import PlanChoice, SetupChoice, check_follower
from touchline.cli.display import progress_bar, warn_of_left_out, warn_of_shortages, warn_of_undone
from touchline.cli.garbage import without_collecting
from touchline.cli.groups import with_groups
from touchline.cli.order_list import OrdersOption, orders_of
from touchline.cli.output_choice import OutputChoice
from touchline.cli.shared_job_runs import TeamOption, TeamProducts, check_team, simulate_team
from touchline.cli.template_choice import TemplateChoice


def register(app: typer.Typer) -> None:
    """Add the subcommand to `app`."""
    app.command("simulate")(with_groups(simulate))


def simulate(
    drawing: TemplateChoice,
    robot: SetupChoice,
    planning: PlanChoice,
    hashed: Annotated[bool, typer.Option("--hash", help="Work out the session hash; takes a little longer.")] = False,
    robots: TeamOption = 1,
    orders: OrdersOption = None,
    *,
    output: OutputChoice,
) -> None:
    """Simulate a template once in this process, without Zenoh: the figures of `run`, many times faster."""
    from touchline.jobs.single.simulation import Job, Outcome, Products
    from touchline.jobs.single.work_picture import draw_work
    from touchline.jobs.way_round.way_round_simulation import simulate_job
    from touchline.jobs.way_round.work_done import draw_work_done
    from touchline.services.robot_sim.emulator import Emulator

    template = drawing.chosen()
    ordered = orders_of(orders or (), robots)
    setup = robot.chosen().at(template.origin)
    check_follower(setup.onboard)
    if robots > 1:
        check_team(setup.vehicle)
        team = TeamProducts(ordered, hashed, output.plot, output.record)
        figures = simulate_team(template, setup, planning.options(), robots, team)
        output.conclude("Simulation", drawing.template, setup, figures)
        return
    with progress_bar("Touchline") as advance:
        with without_collecting():
            job = Job.prepare(template, planning.options(), setup.vehicle, advance)
        warn_of_shortages(job.plan_report, setup.vehicle)
        warn_of_left_out(job.plan_report.left_out)
        products = Products(hashed, output.record, strokes=output.plot is not None)
        with without_collecting():
            robot_there = Emulator(setup.vehicle, setup.scenario, setup.onboard)
            outcome = simulate_job(job, robot_there, products, advance)
        if not isinstance(outcome, Outcome):
            warn_of_undone(outcome.work.warnings())
        if output.plot is not None:
            advance(1.0, "Drawing")
            if isinstance(outcome, Outcome):
                draw_work(template, outcome.strokes, output.plot, outcome.report, outcome.area)
            else:
                draw_work_done(outcome.work, outcome.strokes, output.plot)
        figures = outcome.figures(job)
    output.conclude("Simulation", drawing.template, setup, figures)
