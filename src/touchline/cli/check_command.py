"""``touchline check``: recorded sessions as regression tests of the present code."""

import sys
from collections.abc import Generator, Iterator, Sequence
from contextlib import closing
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeVar

import typer
from rich import box
from rich.markup import escape
from rich.table import Table

from touchline.cli.display import print_json, print_line, print_table, progress_bar, say
from touchline.cli.groups import with_groups
from touchline.cli.options import ExitCode, JsonOption
from touchline.cli.workers_choice import WorkersChoice
from touchline.schemas.errors import SpecError, TouchlineError
from touchline.schemas.plain_text import plain

if TYPE_CHECKING:
    from touchline.checking.check_files import SessionVerdict
    from touchline.checking.difference_plots import Plot


MOST_LISTED = 100
"""Most sessions for which each has a row; of more, only the failures are listed."""

Task = TypeVar("Task")
Done = TypeVar("Done")


def register(app: typer.Typer) -> None:
    """Add the subcommand to `app`."""
    app.command("check")(with_groups(check))


@dataclass(frozen=True)
class ComponentChoice:
    """Component to run alone on recorded inputs."""

    planner_only: Annotated[bool, typer.Option("--planner-only", help="Compare the plans only.")] = False
    estimator_only: Annotated[
        bool, typer.Option("--estimator-only", help="Run only the estimator, on recorded sensors and commands.")
    ] = False
    follower_only: Annotated[
        bool, typer.Option("--follower-only", help="Compare only the onboard computer's decisions on recorded sensors.")
    ] = False

    @property
    def part(self) -> str:
        """Name of the chosen component; "" for the whole robot."""
        asked = {"plan": self.planner_only, "estimator": self.estimator_only, "follower": self.follower_only}
        parts = [name for name, wanted in asked.items() if wanted]
        if len(parts) > 1:
            raise SpecError("command line", "--…-only", "is given more than once", "give one of them")
        return "".join(parts)


def check(
    places: Annotated[
        list[str], typer.Argument(metavar="SESSION…", help="Recordings, folders of recordings, or glob patterns.")
    ],
    *,
    update: Annotated[
        bool, typer.Option("--update", help="Replace sessions that differ by what the present code does; exit code 0.")
    ] = False,
    alone: ComponentChoice,
    processes: WorkersChoice,
    as_json: JsonOption = False,
    html: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write an HTML report with plots to this file.")
    ] = None,
) -> None:
    """Run recorded sessions again with the present code; exit code 1 if one differs or cannot be run.

    Each session is rebuilt from its recording alone: planned, loaded, commanded and driven as it was then. The output
    names the first difference in sim time, and the component that caused it.
    """
    from touchline.checking.check_files import check_file, lost_check, recordings_in
    from touchline.recordings.writing import check_writable

    check_writable(html)
    files = recordings_in(places)
    verdicts: list[SessionVerdict] = []
    interrupted, problem = False, ""
    try:
        for some in _done("Check", files, processes.done(check_file, alone.part, files, lost_check)):
            verdicts += some
    except KeyboardInterrupt:
        interrupted = True
    except TouchlineError as error:
        if not verdicts:
            raise
        problem = str(error)
    verdicts.sort(key=lambda each: (each.path, each.robot, each.process))
    if as_json:
        print_json([asdict(each) for each in verdicts])
    else:
        _print(verdicts)
    if html is not None:
        _write_page(html, places, verdicts, alone.part, processes, interrupted=interrupted or bool(problem))
    if interrupted or problem:
        done = len({each.path for each in verdicts})
        say(f"{problem or 'interrupted'}: {done} of {len(files)} recordings were checked")
        sys.exit(ExitCode.INTERRUPTED if interrupted else ExitCode.FAILED)
    if update:
        _update(verdicts)
    elif not all(each.passed for each in verdicts):
        sys.exit(ExitCode.FAILED)


def _done(title: str, tasks: Sequence[Task], done: Generator[Done, None, None]) -> Iterator[Done]:
    """Yield the result of each task; a bar shows how many are done."""
    with progress_bar(title) as advance, closing(done):
        advance(0.0, f"0 of {len(tasks)}")
        for number, one in enumerate(done, 1):
            yield one
            advance(number / len(tasks), f"{number} of {len(tasks)}")


def _write_page(
    path: Path,
    places: list[str],
    verdicts: "list[SessionVerdict]",
    only: str,
    processes: WorkersChoice,
    *,
    interrupted: bool,
) -> None:
    """Write the page; sessions that it shows in detail are run once more, to be drawn."""
    from datetime import datetime

    from touchline.checking.check_page import page_of, to_be_detailed
    from touchline.checking.draw_differences import drawn_differences, lost_drawing
    from touchline.recordings.writing import write_text

    detailed = to_be_detailed(verdicts)
    tasks = [(i, each) for i, each in enumerate(verdicts) if each in detailed]
    plots: dict[int, list[Plot]] = {i: [] for i, _ in tasks}
    if tasks and not interrupted:
        plots |= dict(_done("Plots", tasks, processes.done(drawn_differences, only, tasks, lost_drawing)))
    what = places[0] if len(places) == 1 else f"{len(places)} places"
    now = datetime.now().astimezone()
    write_text(page_of(plain(what, 200), verdicts, plots, now, interrupted=interrupted), path)
    say(f"wrote {path}")


def _update(verdicts: "list[SessionVerdict]") -> None:
    """Replace the recordings that differ; one that cannot be read or run is left unchanged and is an error."""
    from touchline.checking.check_session import update_recording

    for each in verdicts:
        if each.problem:
            raise TouchlineError(f"{each.path} is not replaced: {each.problem}")
    for path in dict.fromkeys(each.path for each in verdicts if not each.passed):
        update_recording(Path(path))
        say(f"replaced {path}")


def _print(verdicts: "list[SessionVerdict]") -> None:
    names = list(dict.fromkeys(metric.name for each in verdicts for metric in each.metrics))
    table = Table(box=box.SIMPLE_HEAD)
    for heading in ("session", "robot", "verdict", "first"):
        table.add_column(heading, overflow="fold")
    for heading in (*names, "messages", "× real time"):
        table.add_column(heading, justify="right")
    listed = verdicts
    if len(verdicts) > MOST_LISTED:
        listed = [each for each in verdicts if not each.passed][:MOST_LISTED]
    for each in listed:
        verdict = (
            "[green]same[/]" if each.passed else "[bold red]cannot tell[/]" if each.problem else "[bold red]differs[/]"
        )
        factor = f"{each.sim_time_s / each.wall_time_s:,.0f}" if each.wall_time_s else ""
        metrics = {metric.name: str(metric) for metric in each.metrics}
        figures = [*(metrics.get(name, "") for name in names), f"{each.messages:,}", factor]
        table.add_row(escape(plain(Path(each.path).name)), escape(plain(each.who)), verdict, each.part, *figures)
    if listed:
        print_table(table)
    for each in listed:
        for line in each.lines():
            if line.startswith("  "):
                print_line(line)
            else:
                say(line)
    same = sum(each.passed for each in verdicts)
    print_line(f"{same:,} of {len(verdicts):,} sessions come out the same")
