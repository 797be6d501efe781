"""Plots of a session that differs, as SVG for a page: recorded in blue, present in orange."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from io import StringIO
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.checking.difference_traces import (
    INNOVATIONS,
    BothSides,
    DifferenceTraces,
    TimeSeries,
    difference,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Floats = NDArray[np.float64]

RECORDED, TODAY, APART = "#2563eb", "#ea580c", "#7c3aed"
_STYLE: Final[dict[Any, Any]] = {
    "svg.fonttype": "none",
    "text.parse_math": False,
    "font.family": "sans-serif",
    "font.size": 9.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "#94a3b8",
    "axes.labelcolor": "#475569",
    "axes.grid": True,
    "grid.color": "#e2e8f0",
    "xtick.color": "#64748b",
    "ytick.color": "#64748b",
    "lines.linewidth": 1.3,
    "legend.frameon": False,
    "axes.formatter.useoffset": False,
}
_WIDE_IN: Final = (7.2, 2.3)
_TALL_IN: Final = (7.2, 3.4)
_MAP_IN: Final = (7.2, 4.6)
_MILLIMETRES_BELOW_M: Final = 0.5
_LONG: Final = re.compile(r"(\d+\.\d)\d+")
"""Numbers in SVG, of which tenths of a point suffice."""


Line = tuple[TimeSeries, str, str]
"""(values, colour, name)"""


class Plot(NamedTuple):
    """A plot and its title.

    Attributes:
        title: A few words.
        svg: An ``<svg>`` element.
    """

    title: str
    svg: str


def plots_of(traces: DifferenceTraces) -> list[Plot]:
    """Plot the most telling fields of both sessions."""
    first, found = traces.first, field_plots(traces)
    paths = traces.paths
    if len(paths.recorded.time_s) and len(paths.today.time_s):
        found.append(Plot("Paths of the robots", plan_view(paths.recorded.values, paths.today.values, _place(traces))))
        whole = (
            ("Distance between the two at the same sim time", [(traces.apart, APART, "distance")]),
            ("Cross-track error, as the robots believed", both_lines(traces.lateral)),
            ("Error of the position estimate", both_lines(traces.estimate_error)),
        )
        found += [Plot(title, over_time(lines, first.time_s)) for title, lines in whole if _any(lines)]
    return found


def estimate_plots(traces: DifferenceTraces) -> list[Plot]:
    """Plot an estimator that was run alone: errors and difference of the estimates, and their consistency."""
    nis, east, north = (traces.consistency(name) for name in ("fix_nis_recent", *INNOVATIONS))
    whole = (
        ("Error of the position estimate", both_lines(traces.estimate_error), "m"),
        ("Distance between the two estimates", [(traces.estimates_apart, APART, "distance")], "m"),
        ("NIS of fixes, running mean over about ten (2 expected)", both_lines(nis), ""),
        ("Innovations of fixes to the east", both_lines(east), "m"),
        ("Innovations of fixes to the north", both_lines(north), "m"),
    )
    plots = [Plot(title, over_time(lines, traces.first.time_s, unit)) for title, lines, unit in whole if _any(lines)]
    return field_plots(traces) + plots


def field_plots(traces: DifferenceTraces) -> list[Plot]:
    """Plot the field that differs first, around that time; nothing if neither session has it."""
    first, pair = traces.first, traces.field
    if not len(pair.recorded.time_s) and not len(pair.today.time_s):
        return []
    title = f"What differs first: {first.topic} {first.field}"
    return [Plot(title, field_plot(pair, first.unit, first.time_s))]


def _any(lines: Sequence[Line]) -> bool:
    return any(len(series.time_s) for series, _, _ in lines)


def plan_view(recorded: Floats, today: Floats, place: Floats | None = None) -> str:
    """Plot two paths, (n, 2) and (m, 2) (m, map frame), from above, and mark a place (2,).

    Args:
        recorded: (n, 2) recorded path, m, map frame.
        today: (m, 2) present path, m, map frame.
        place: (2,) place of the first difference, m, map frame.
    """

    def draw(axes: Sequence[Axes]) -> None:
        (view,) = axes
        view.plot(*recorded.T, color=RECORDED, label="recorded", linewidth=2.2, alpha=0.55)
        view.plot(*today.T, color=TODAY, label="today", linewidth=0.9)
        if place is not None:
            view.plot(
                *place, "o", color="#0f172a", markersize=8, fillstyle="none", label="first difference", clip_on=False
            )
        view.set_aspect("equal", "datalim")
        view.margins(0.04)
        view.set_xlabel("x, east (m)")
        view.set_ylabel("y, north (m)")
        view.figure.legend(loc="outside upper right", ncols=3)

    return _drawn(draw, _MAP_IN)


def _place(traces: DifferenceTraces) -> Floats:
    """Return where the robot was in the recording at the first difference."""
    path = traces.paths.recorded
    place: Floats = path.values[np.abs(path.time_s - traces.first.time_s).argmin()]
    return place


def both_lines(pair: BothSides) -> list[Line]:
    """Return a line for each side."""
    return [(pair.recorded, RECORDED, "recorded"), (pair.today, TODAY, "today")]


def field_plot(pair: BothSides, unit: str, first_s: float) -> str:
    """Plot values of both sides and their difference, each point, and mark the first difference.

    Args:
        pair: Values of both sides.
        unit: Unit of the values; "" if there is none.
        first_s: Sim time of the first difference.
    """
    unit_text = f" ({unit})" if unit else ""

    def draw(axes: Sequence[Axes]) -> None:
        values, apart = axes
        for series, colour, name in both_lines(pair):
            values.plot(series.time_s, series.values, color=colour, label=name, marker=".", markersize=2.5)
        off = difference(pair)
        apart.plot(off.time_s, off.values, color=APART, marker=".", markersize=2.5)
        for each in axes:
            each.axvline(first_s, color="#0f172a", linewidth=0.8, linestyle=":")
        values.tick_params(labelbottom=False)
        values.set_ylabel(f"value{unit_text}")
        apart.set_ylabel(f"present − rec.{unit_text}")
        apart.set_xlabel("sim time (s)")
        values.figure.legend(loc="outside upper right", ncols=2)

    return _drawn(draw, _TALL_IN, rows=2)


def over_time(lines: Sequence[Line], first_s: float, unit: str = "m") -> str:
    """Plot values over sim time and mark the first difference; small lengths are in mm.

    Args:
        lines: Lines to plot.
        first_s: Sim time of the first difference.
        unit: Unit of the values; "" if there is none.
    """
    most = max(float(np.abs(series.values).max()) for series, _, _ in lines if len(series.time_s))
    scale, shown = (1000.0, "mm") if unit == "m" and most < _MILLIMETRES_BELOW_M else (1.0, unit)

    def draw(axes: Sequence[Axes]) -> None:
        (view,) = axes
        for series, colour, name in lines:
            view.plot(series.time_s, scale * series.values, color=colour, label=name, linewidth=1.0)
        view.axvline(first_s, color="#0f172a", linewidth=0.8, linestyle=":")
        view.set_xlabel("sim time (s)")
        view.set_ylabel(shown)
        if len(lines) > 1:
            view.figure.legend(loc="outside upper right", ncols=2)

    return _drawn(draw, _WIDE_IN)


def _drawn(draw: Callable[[Sequence[Axes]], None], size_in: tuple[float, float], rows: int = 1) -> str:
    import matplotlib as mpl
    from matplotlib.figure import Figure

    with mpl.rc_context(_STYLE):
        figure = Figure(figsize=size_in, layout="constrained")
        views = figure.subplots(rows, 1, sharex=rows > 1, squeeze=False)[:, 0]
        draw(list(views))
        text = StringIO()
        figure.savefig(text, format="svg", transparent=True, metadata={"Date": None, "Creator": None})
    svg = text.getvalue()
    svg = svg[svg.index("<svg") :]
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    return re.sub(r' d="[^"]*"', lambda path: _LONG.sub(r"\1", path[0]), svg)
