"""HTML page of a check: one self-contained file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import Final, NamedTuple

from touchline.checking.check_files import SessionVerdict
from touchline.checking.difference_plots import Plot
from touchline.checking.session_metrics import SessionMetric
from touchline.recordings.provenance import made_by
from touchline.schemas.plain_text import plain

MOST_DETAILED: Final = 20
"""Most sessions shown in detail, with plots."""
MOST_LISTED: Final = 2000
"""Most rows of the table; those that differ come first."""
_LONGEST_NAME: Final = 120


class PageRow(NamedTuple):
    """Session on the page.

    Attributes:
        verdict: Its verdict.
        name: Name of its file.
        metrics: One for each column of the table; None where it has none.
        anchor: Anchor of its details; empty if there are none.
        plots: Plots in its details.
    """

    verdict: SessionVerdict
    name: str
    metrics: tuple[SessionMetric | None, ...]
    anchor: str
    plots: Sequence[Plot]


def to_be_detailed(verdicts: Sequence[SessionVerdict]) -> list[SessionVerdict]:
    """Return the verdicts to show in detail: one of each component that differs first, then others in order."""
    odd = [each for each in verdicts if not each.passed]
    parts = {each.part or each.problem: each for each in reversed(odd)}
    chosen = [*parts.values(), *odd][: MOST_DETAILED + len(parts)]
    return list({id(each): each for each in chosen}.values())[:MOST_DETAILED]


def page_of(
    what: str,
    verdicts: Sequence[SessionVerdict],
    plots: Mapping[int, Sequence[Plot]],
    when: datetime,
    *,
    interrupted: bool = False,
) -> str:
    """Return the page.

    Args:
        what: The checked files.
        verdicts: Verdicts, one per session.
        plots: Plots of the sessions in detail, by the index of the verdict.
        when: Time of the check.
        interrupted: Whether the check is incomplete.
    """
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    names = list(dict.fromkeys(metric.name for each in verdicts for metric in each.metrics))
    order = sorted(range(len(verdicts)), key=lambda i: (i not in plots, verdicts[i].passed))
    rows = [_row(verdicts[i], i, names, plots) for i in order[:MOST_LISTED]]
    odd = sum(not each.passed for each in verdicts)
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent),
        autoescape=True,  # names, texts and values come from recordings
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    text: str = environment.get_template("page.html.jinja").render(
        what=what,
        when=when.strftime("%Y-%m-%d %H:%M"),
        verdicts=verdicts,
        rows=rows,
        metric_names=names,
        now=made_by(),
        shown=_shown,
        same=len(verdicts) - odd,
        problems=sum(bool(each.problem) for each in verdicts),
        differ=sum(not each.passed and not each.problem for each in verdicts),
        messages=sum(each.messages for each in verdicts),
        sim_time_s=sum(each.sim_time_s for each in verdicts),
        left_out=max(len(verdicts) - MOST_LISTED, 0),
        not_detailed=odd - len(plots),
        interrupted=interrupted,
    )
    return text


def _row(verdict: SessionVerdict, i: int, names: Sequence[str], plots: Mapping[int, Sequence[Plot]]) -> PageRow:
    metrics = {metric.name: metric for metric in verdict.metrics}
    name = plain(Path(verdict.path).name, _LONGEST_NAME)
    anchor = f"session-{i}" if i in plots else ""
    return PageRow(verdict, name, tuple(metrics.get(each) for each in names), anchor, plots.get(i, ()))


def _shown(value: float | None) -> str:
    return "none" if value is None else f"{value:.6g}"
