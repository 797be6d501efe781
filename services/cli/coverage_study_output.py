"""``touchline study coverage``: the study of area coverage, as a table, Markdown or JSON."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import typer
from rich import box
from rich.table import Table

from touchline.services.cli.display import output, progress_bar, say
from touchline.services.cli.options import ExitCode
from touchline.services.runs.writing import write_text, writing

if TYPE_CHECKING:
    from touchline.services.study.coverage_study import CoverageRow

HEADINGS = ("", "of the field", "of the reachable (planned)", "min", "cusps", "drum p95", "body outside", "must", "met")
MARKDOWN, JSON = "coverage-study.md", "coverage-study.json"
_VERDICTS = {True: "yes", False: "NO", None: ""}
_STYLES = {True: "green", False: "bold red", None: "dim"}


def coverage_study(seeds: int, out: Path | None, *, as_json: bool) -> None:
    """Measure and print it; exit code 1 if something that is asked for is missed."""
    from touchline.services.study.coverage_study import run_coverage_study
    from touchline.services.study.lane_edges import edge_cases

    with progress_bar("Study") as advance:
        rows = run_coverage_study(seeds, lambda what, done: advance(done, what))
    text = json.dumps([asdict(row) for row in rows], indent=1, ensure_ascii=False) + "\n"
    if out is not None:
        with writing(out, "folder"):
            out.mkdir(parents=True, exist_ok=True)
        write_text(_markdown(rows), out / MARKDOWN)
        write_text(text, out / JSON)
        say(f"wrote {MARKDOWN}, {JSON} to {out}")
    if as_json:
        typer.echo(text, nl=False)
    else:
        output().print(_table(rows))
        for case in edge_cases():
            found = f"{case.by_direction} by direction of travel, {case.by_slope} by the study's slope"
            output().print(f"edges between lanes, {case.name}: {case.edges} there, {found}", highlight=False)
    if any(row.met is False for row in rows):
        raise typer.Exit(ExitCode.FAILED)


def _table(rows: "list[CoverageRow]") -> Table:
    table = Table(
        title="Covering 93 × 47.6 m with a roller", title_justify="left", box=box.SIMPLE_HEAD, show_lines=True
    )
    for heading in HEADINGS:
        table.add_column(heading)
    for row in rows:
        *cells, met = _cells(row)
        table.add_row(*cells, f"[{_STYLES[row.met]}]{met}[/]")
    return table


def _markdown(rows: "list[CoverageRow]") -> str:
    lines = [HEADINGS, ("---",) * len(HEADINGS), *(_cells(row) for row in rows)]
    return "".join(f"| {' | '.join(cells)} |\n" for cells in lines)


def _cells(row: "CoverageRow") -> tuple[str, ...]:
    return (
        f"{row.name} ({row.note})" if row.note else row.name,
        f"{row.coverage_pct:.2f} %",
        f"{row.share_pct:.2f} %",
        f"{row.minutes:.1f}",
        str(row.cusps),
        f"{1e2 * row.p95_m:.1f} cm" if row.p95_m is not None else "",
        f"{1e2 * max(row.body_outside_m, 0.0):.1f} cm",
        row.must,
        _VERDICTS[row.met],
    )
