"""Pictures of the network study: paths of the smallest team by all rules, H over time, and an animation."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from touchline.coordination.lloyd import square_cost
from touchline.services.planner.plots.style import INK, plan_style, save
from touchline_research.network.moving_picture import TOUCHING, moving_picture
from touchline_research.network.team_trials import BEARING, FREE, OURS, TeamRecord, TeamRules

if TYPE_CHECKING:
    from matplotlib.axes import Axes

DPI = 100
COMPARED: Final = (
    ("straight velocities", "none"),
    ("ORCA, by radio", "none"),
    ("ORCA, by radio", "plans"),
    ("goals", "plans"),
)
"""Wishes, and what keeps apart, of the panels of the animation."""
COLOURS: Final = {BEARING: "#d9480f", FREE: "#e8a33d", OURS: "#1769aa"}


def save_team_pictures(records: Sequence[TeamRecord], folder: Path, compared: Sequence[TeamRecord] = ()) -> list[Path]:
    """Write all pictures to a folder; returns the files.

    Args:
        records: Runs of task deploy.
        folder: The folder.
        compared: Runs of algorithms.

    Raises:
        OSError: A file cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    more = _compared_picture(compared, folder)
    least = min(record.trial.robots for record in records)
    first = [record for record in records if record.trial.robots == least and record.trial.seed == 1]
    paths, costs, moving = (folder / f"network-{name}" for name in ("ways.png", "cost.png", "moving.svg"))
    with plan_style():
        plot_paths(first, paths)
        plot_costs(records, costs)
    pair = [record for record in first if record.trial.rules != FREE]
    moving.write_text(moving_picture(pair), encoding="utf-8")
    return [paths, costs, moving, *more]


def _compared_picture(records: Sequence[TeamRecord], folder: Path) -> list[Path]:
    """Write the animation of some algorithms that change places from the same starts."""
    shown = [
        next((each for each in records if each.trial.rules[:2] == panel and each.trial.seed == 1), None)
        for panel in COMPARED
    ]
    found = [each._replace(trial=each.trial._replace(rules=_named(each))) for each in shown if each is not None]
    if not found:
        return []
    path = folder / "network-algorithms.svg"
    path.write_text(moving_picture(found), encoding="utf-8")
    return [path]


def _named(record: TeamRecord) -> TeamRules:
    """Rules whose name says what keeps robots apart, too."""
    rules = record.trial.rules
    return rules._replace(name=f"{rules.name}; {rules.avoid}")


def plot_paths(records: Sequence[TeamRecord], path: Path) -> None:
    """Plot the robots' paths of each run side by side; crosses are contacts."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(4.2 * len(records), 5.0), layout="constrained")
    for axes, record in zip(
        figure.subplots(1, len(records), squeeze=False, sharex=True, sharey=True)[0], records, strict=True
    ):
        _paths(axes, record)
    save(figure, path, DPI)


def _paths(axes: "Axes", record: TeamRecord) -> None:
    from matplotlib import colormaps
    from matplotlib.patches import Circle

    places, trace = np.array(record.trace.places), record.trace
    colours = colormaps["tab10"](np.arange(10))
    for number in range(places.shape[1]):
        colour, track = colours[number % len(colours)], places[:, number]
        axes.plot(*track.T, color=colour, linewidth=0.9)
        axes.plot(*track[0], "o", color=colour, markersize=3)
        axes.add_patch(Circle(tuple(track[-1]), record.body_radius_m, color=colour, alpha=0.6, linewidth=0))
    for time_s, who in trace.touched:
        at = min(int(np.searchsorted(trace.times_s, time_s)), len(places) - 1)
        axes.plot(*places[at, list(who)].T, "x", color=TOUCHING, markersize=6, markeredgewidth=1.6)
    outline = np.array(record.area.shape.exterior.coords)
    axes.plot(*outline.T, color=INK, linewidth=1.0)
    axes.set_title(f"{record.trial.rules.name}: {record.figures['contacts']} contacts")
    axes.set_aspect("equal")
    axes.set(xlabel="x (m)", ylabel="y (m)")
    axes.spines[["top", "right"]].set_visible(False)


def plot_costs(records: Sequence[TeamRecord], path: Path) -> None:
    """Plot H over time relative to that of squares, a line for each run, a panel for each size of team."""
    from matplotlib.figure import Figure

    sizes = sorted({record.trial.robots for record in records})
    figure = Figure(figsize=(4.2 * len(sizes) + 1.0, 3.6), layout="constrained")
    panels = figure.subplots(1, len(sizes), squeeze=False, sharey=True)[0]
    for axes, size in zip(panels, sizes, strict=True):
        for record in (each for each in records if each.trial.robots == size):
            _cost(axes, record)
        axes.axhline(1.0, color=INK, linewidth=0.8, linestyle=(0, (4, 3)))
        axes.set_title(f"{size} robots")
        axes.set(xlabel="time (s)", yscale="log", yticks=(1, 2, 5, 10, 20, 50), yticklabels=(1, 2, 5, 10, 20, 50))
        axes.spines[["top", "right"]].set_visible(False)
        axes.grid(color="#e3e6e4", linewidth=0.7)
    panels[0].set_ylabel("H / H□")
    lines, names = panels[0].get_legend_handles_labels()
    one_each = dict(zip(names, lines, strict=True))
    panels[0].legend(one_each.values(), one_each.keys(), frameon=False)
    save(figure, path, DPI)


def _cost(axes: "Axes", record: TeamRecord) -> None:
    cost = np.array(record.trace.cost) / square_cost(record.trial.robots, record.area.area_m2)
    rules = record.trial.rules
    axes.plot(record.trace.times_s, cost, color=COLOURS[rules], linewidth=1.0, label=rules.name)
