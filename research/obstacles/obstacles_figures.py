"""Pictures of the study of obstacles: contacts over speed by each rule, and ways in a world of each kind."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
import shapely

from touchline.services.planner.geometry.clothoid import PathPose
from touchline.services.planner.plots.style import INK, plan_style, save
from touchline_research.obstacles.free_worlds import KINDS, placed, world
from touchline_research.obstacles.protected_lines import RULES, LineRuns
from touchline_research.obstacles.ways_to_goals import OURS, OURS_AS_CAR, OUTLINE, RRT, Trial

if TYPE_CHECKING:
    from matplotlib.axes import Axes

DPI = 100
OURS_COLOUR, OTHER_COLOURS = ("#1769aa", "#7fb2d9"), ("#d9480f", "#e8a33d", "#8a5a2b", "#5f8f4e", "#7b4fa0")
COLOURS: Final = dict(zip((rule.name for rule in RULES), (*OURS_COLOUR, *OTHER_COLOURS), strict=True))
WAY_COLOURS: Final = {OURS: "#1769aa", OURS_AS_CAR: "#7fb2d9", RRT: "#e8a33d"}
BIT_STAR_COLOUR, WALL_COLOUR = "#d9480f", "#c9cfcb"


def save_obstacle_pictures(lines: Sequence[LineRuns], trials: Sequence[Trial], folder: Path) -> list[Path]:
    """Write all pictures to `folder`; returns the files.

    Raises:
        OSError: A file cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    contacts, ways = folder / "obstacles-contacts.png", folder / "obstacles-ways.png"
    with plan_style():
        plot_contacts(lines, contacts)
        plot_ways(trials, ways)
    return [contacts, ways]


def plot_contacts(lines: Sequence[LineRuns], path: Path) -> None:
    """Plot contacts in motion over mean speed by each rule, a panel for each crowd."""
    from matplotlib.figure import Figure

    crowds = list(dict.fromkeys(each.people.name for each in lines))
    figure = Figure(figsize=(10.0, 4.4), layout="constrained")
    panels = figure.subplots(1, len(crowds), sharex=True, sharey=True, squeeze=False)[0]
    for axes, crowd in zip(panels, crowds, strict=True):
        for each in lines:
            if each.people.name == crowd:
                point = each.mean_mps, each.moving / each.hours
                axes.plot(*point, "o", color=COLOURS[each.rule.name], markersize=9, label=each.rule.name, clip_on=False)
        axes.set_yscale("symlog", linthresh=1.0)
        axes.set(title=crowd, xlabel="mean speed (m/s)", xlim=(0.0, 1.45), ylim=(0.0, 2000.0))
        axes.spines[["top", "right"]].set_visible(False)
        axes.grid(color="#e3e6e4", linewidth=0.7)
        axes.set_axisbelow(True)
    panels[0].set_ylabel("contacts in motion per hour")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False)
    save(figure, path, DPI)


def plot_ways(trials: Sequence[Trial], path: Path) -> None:
    """Plot the ways of all planners to the goal of each kind of world that is farthest by ours."""
    from matplotlib.figure import Figure

    longest: dict[int, Trial] = {}
    for each in sorted(trials, key=_length_m):
        longest[each.seed % len(KINDS)] = each
    figure = Figure(figsize=(3.6 * len(longest), 4.4), layout="constrained")
    panels = figure.subplots(1, len(longest), squeeze=False)[0]
    for axes, (kind, trial) in zip(panels, sorted(longest.items()), strict=True):
        _plot_trial(axes, trial)
        axes.set_title(f"{KINDS[kind]}: {_length_m(trial):.1f} m by ours")
    labels = {text: line for axes in panels for line, text in zip(*axes.get_legend_handles_labels(), strict=True)}
    figure.legend(labels.values(), labels.keys(), loc="outside lower center", ncols=3, frameon=False)
    save(figure, path, DPI)


def _length_m(trial: Trial) -> float:
    ours = trial.ways[OURS]
    return ours.length_m if ours else 0.0


def _plot_trial(axes: "Axes", trial: Trial) -> None:
    ground = world(trial.seed)
    axes.fill(*np.transpose(ground.hull.exterior.coords), color=WALL_COLOUR)
    for part in shapely.get_parts(ground.free):
        axes.fill(*np.transpose(part.exterior.coords), color="white")
        for ring in part.interiors:
            axes.fill(*np.transpose(ring.coords), color=WALL_COLOUR)
    for planner, way in trial.ways.items():
        if way is not None:
            axes.plot(*way.places.T, color=WAY_COLOURS.get(planner, BIT_STAR_COLOUR), linewidth=1.6, label=planner)
    for pose, filled in ((trial.start, 0.5), (trial.goal, 0.0)):
        _plot_body(axes, pose, filled)
    axes.set_aspect("equal")
    axes.set_axis_off()


def _plot_body(axes: "Axes", pose: PathPose, filled: float) -> None:
    corners = np.transpose(placed(OUTLINE, pose).exterior.coords)
    axes.plot(*corners, color=INK, linewidth=1.0)
    axes.fill(*corners, color=INK, alpha=filled, linewidth=0.0)
