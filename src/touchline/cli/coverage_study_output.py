"""``touchline study coverage``: the study of area coverage, as tables, Markdown or JSON."""

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from touchline.cli.display import print_line, progress_bar
from touchline.cli.study_output import as_text, exit_if_missed, print_tables, write_tables

if TYPE_CHECKING:
    from touchline_research.coverage_study import CoverageRow
    from touchline_research.target_table import TargetTable

COLUMNS = ("", "of the field", "of the reachable (planned)", "min", "cusps", "drum p95", "body outside")
STEM = "coverage-study"


def coverage_study(seeds: int, out: Path | None, *, as_json: bool) -> None:
    """Run and print the study; exit code 1 if a requirement is missed."""
    from touchline_research.coverage_study import run_coverage_study
    from touchline_research.lane_edges import edge_cases

    with progress_bar("Study") as advance:
        rows = run_coverage_study(seeds, lambda what, done: advance(done, what))
    table, text = _table(rows), as_text([asdict(row) for row in rows])
    if out is not None:
        write_tables([table], text, out, STEM)
    if as_json:
        typer.echo(text, nl=False)
    else:
        print_tables([table])
        for case in edge_cases():
            found = f"{case.by_direction} by direction of travel, {case.by_slope} by the study's slope"
            print_line(f"edges between lanes, {case.name}: {case.edges} there, {found}")
    exit_if_missed([table])


def _table(rows: "list[CoverageRow]") -> "TargetTable":
    from touchline_research.target_table import TargetRow, TargetTable

    judged = tuple(TargetRow(_cells(row), row.must, row.met) for row in rows)
    return TargetTable("Covering 93 × 47.6 m with a roller", COLUMNS, judged)


def _cells(row: "CoverageRow") -> tuple[str, ...]:
    return (
        f"{row.name} ({row.note})" if row.note else row.name,
        f"{row.coverage_pct:.2f} %",
        f"{row.share_pct:.2f} %",
        f"{row.minutes:.1f}",
        str(row.cusps),
        f"{1e2 * row.p95_m:.1f} cm" if row.p95_m is not None else "",
        f"{1e2 * max(row.body_outside_m, 0.0):.1f} cm",
    )
