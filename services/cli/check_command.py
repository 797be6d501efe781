"""``touchline check``: whether recorded sessions come out the same with the code of today."""

import json
import sys
from collections.abc import Generator
from contextlib import closing
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich import box
from rich.table import Table

from touchline.schemas.errors import SpecError, TouchlineError
from touchline.schemas.plain_text import plain
from touchline.services.cli.display import output, progress_bar, say
from touchline.services.cli.groups import with_groups
from touchline.services.cli.options import ExitCode, JsonOption
from touchline.services.cli.workers_choice import WorkersChoice

if TYPE_CHECKING:
    from touchline.services.runs.checking.check_files import SessionVerdict


def register(app: typer.Typer) -> None:
    """Add the subcommand."""
    app.command("check")(with_groups(check))


@dataclass(frozen=True)
class AloneChoice:
    """Which part alone is run on what was recorded."""

    planner_only: Annotated[bool, typer.Option("--planner-only", help="Make the plans again, and no more.")] = False
    estimator_only: Annotated[
        bool, typer.Option("--estimator-only", help="Run the estimator alone, on the recorded sensors and commands.")
    ] = False
    follower_only: Annotated[
        bool, typer.Option("--follower-only", help="Compare what the computer decides on the recorded sensors alone.")
    ] = False

    @property
    def part(self) -> str:
        """Its name; "" for the whole robot."""
        asked = {"plan": self.planner_only, "estimator": self.estimator_only, "follower": self.follower_only}
        parts = [name for name, wanted in asked.items() if wanted]
        if len(parts) > 1:
            raise SpecError("command line", "--…-only", "is given more than once", "give one of them")
        return "".join(parts)


def check(
    places: Annotated[
        list[str],
        typer.Argument(metavar="SESSION…", help="Recordings, folders of them, or patterns.", show_default=False),
    ],
    *,
    update: Annotated[
        bool, typer.Option("--update", help="Write those that differ anew, as today's code does them; exit code 0.")
    ] = False,
    alone: AloneChoice,
    processes: WorkersChoice,
    as_json: JsonOption = False,
) -> None:
    """Do recorded sessions again with the code of today and compare; exit code 1 if one differs or cannot be done.

    Each is rebuilt from its recording alone: planned, loaded, ordered about and driven as it was then. What is told
    is where the two part first in sim time, and which part of the robot did so.
    """
    from touchline.services.robot_sim.warm_up import warm_up
    from touchline.services.runs.checking.check_files import check_file, recordings_in

    files = recordings_in(places)
    verdicts: list[SessionVerdict] = []
    interrupted = False
    with progress_bar("Check") as advance:
        if len(files) > 1:
            warm_up(say)  # so that not every process compiles
        done: Generator[list[SessionVerdict], None, None] = processes.done(check_file, alone.part, files)
        advance(0.0, f"0 of {len(files)}")
        try:
            with closing(done):
                for number, some in enumerate(done, 1):
                    verdicts += some
                    advance(number / len(files), f"{number} of {len(files)}: {Path(some[0].path).name}")
        except KeyboardInterrupt:
            interrupted = True
    verdicts.sort(key=lambda each: (each.path, each.robot))
    if as_json:
        typer.echo(json.dumps([asdict(each) for each in verdicts], indent=1, ensure_ascii=False))
    else:
        _print(verdicts)
    if interrupted:
        sys.exit(ExitCode.INTERRUPTED)
    if update:
        _update(verdicts)
    elif not all(each.passed for each in verdicts):
        sys.exit(ExitCode.FAILED)


def _update(verdicts: "list[SessionVerdict]") -> None:
    """Write those that differ anew; one that cannot be read or done is left as it is, and an error."""
    from touchline.services.runs.checking.check_session import update_recording

    for each in verdicts:
        if each.problem:
            raise TouchlineError(f"{each.path} is not written anew: {each.problem}")
    for path in dict.fromkeys(each.path for each in verdicts if not each.passed):
        update_recording(Path(path))
        say(f"wrote {path} anew")


def _print(verdicts: "list[SessionVerdict]") -> None:
    table = Table(box=box.SIMPLE_HEAD)
    for heading in ("session", "robot", "verdict", "first"):
        table.add_column(heading, overflow="fold")
    table.add_column("messages", justify="right")
    table.add_column("× real time", justify="right")
    for each in verdicts:
        verdict = (
            "[green]same[/]" if each.passed else "[bold red]cannot tell[/]" if each.problem else "[bold red]differs[/]"
        )
        factor = f"{each.sim_time_s / each.wall_time_s:,.0f}" if each.wall_time_s else ""
        name = plain(Path(each.path).name)
        table.add_row(name, plain(each.robot), verdict, each.part, f"{each.messages:,}", factor)
    output().print(table)
    for each in verdicts:
        for line in each.lines():
            (output().print if line.startswith("  ") else say)(line)
    same = sum(each.passed for each in verdicts)
    output().print(f"{same} of {len(verdicts)} sessions come out the same", highlight=False)
