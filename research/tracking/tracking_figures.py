"""Pictures of the tracking study: paths with k = 10 and with chosen k, two trackers, and domains of attraction."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from touchline.services.planner.geometry.clothoid import PathPose
from touchline.services.planner.plots.style import INK, plan_style, save
from touchline.services.planner.poses.kernels.cubic_curve import point
from touchline.services.planner.poses.speed_laws import CUBIC
from touchline_research.tracking.attraction import Domain
from touchline_research.tracking.cubic_reference import timed_curve
from touchline_research.tracking.studied_robot import YAW_RADPS
from touchline_research.tracking.tracker_runs import LAWS, CurveTo, by_choice, by_distance, by_study
from touchline_research.tracking.tracking_loop import STEP_S, STUDIED, by_law, track_reference

if TYPE_CHECKING:
    from matplotlib.axes import Axes

DPI = 130
POINTS = 2_000
GOALS: Final = (
    PathPose(2.0, 0.05, 0.0),
    PathPose(1.5, 1.4, 1.2),
    PathPose(2.5, -1.2, -1.0),
    PathPose(4.0, 1.0, 0.3),
)
TRACKED_GOAL: Final = PathPose(3.0, 1.0, 0.6)
COLOURS: Final = ("#d9480f", "#1769aa", "#2b8a3e", "#7048a8")
TRACKERS: Final = {"linear": COLOURS[0], "regularised": COLOURS[1]}
SCALES: Final = (1.0, 100.0, 100.0, math.degrees(1.0))


def save_pictures(found: Mapping[str, Domain], folder: Path) -> list[Path]:
    """Write all pictures to `folder`; returns the files.

    Raises:
        OSError: A file cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    paths, commands, attracted = (folder / f"tracking-{name}.png" for name in ("paths", "commands", "attraction"))
    with plan_style():
        plot_paths(paths)
        plot_commands(commands)
        plot_attraction(found, attracted)
    return [paths, commands, attracted]


def plot_paths(path: Path) -> None:
    """Plot cubic curves to some goals, with the study's tangents and with chosen ones."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.0, 4.2), layout="constrained")
    kinds: tuple[tuple[str, CurveTo], ...] = (("k = 10, the study's", by_study), ("k chosen", by_choice))
    for axes, (title, curve_to) in zip(figure.subplots(1, 2, sharex=True, sharey=True), kinds, strict=True):
        for goal, colour in zip(GOALS, COLOURS, strict=True):
            places = point(curve_to(goal), np.linspace(0.0, 1.0, POINTS))
            axes.plot(places.real, places.imag, color=colour, linewidth=1.6)
            _arrow(axes, goal, colour)
        _arrow(axes, PathPose(0.0, 0.0, 0.0), INK)
        axes.set_title(title)
        axes.set_aspect("equal")
        _axes(axes, "x (m)", "y (m)")
    save(figure, path, DPI)


def _arrow(axes: "Axes", pose: PathPose, colour: str) -> None:
    tip = pose.point + 0.3 * pose.direction
    axes.annotate(
        "",
        xy=(tip.real, tip.imag),
        xytext=(pose.x_m, pose.y_m),
        arrowprops={"arrowstyle": "-|>", "color": colour, "linewidth": 2.2},
    )


def plot_commands(path: Path) -> None:
    """Plot errors and commanded yaw rates of the linear and the regularised law under the same disturbances."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 6.6), layout="constrained")
    rows = figure.subplots(4, 1, sharex=True)
    reference = timed_curve(by_distance(TRACKED_GOAL), CUBIC)
    time = STEP_S * np.arange(len(reference.poses))
    for name, colour in TRACKERS.items():
        run = track_reference(by_law(LAWS[name]), reference, disturbances=STUDIED, seed=1)
        for axes, values, scale in zip(rows, (run.commands[:, 1], *run.errors.T), SCALES, strict=True):
            axes.plot(time, scale * values, color=colour, linewidth=1.0, label=name)
    rows[0].set_yscale("symlog", linthresh=1.0)
    for limit in (-YAW_RADPS, YAW_RADPS):
        rows[0].axhline(limit, color=INK, linewidth=0.8, linestyle=(0, (4, 3)))
    rows[0].set_title("On the path with 5 mm and 0.3° of noise: the robot's limit is dashed")
    rows[0].legend(frameon=False, loc="upper center", ncols=2)
    for axes, label in zip(rows, ("ω asked (rad/s)", "ahead e₁ (cm)", "left e₂ (cm)", "turned e₃ (°)"), strict=True):
        _axes(axes, "time (s)" if axes is rows[-1] else "", label)
    save(figure, path, DPI)


def plot_attraction(found: Mapping[str, Domain], path: Path) -> None:
    """Plot the time until each law reaches its reference over the start."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.0, 5.2), layout="constrained")
    panels = figure.subplots(2, 3, sharex=True, sharey=True).ravel()
    longest_s = max(float(np.nanmax(domain.settled_s)) for domain in found.values())
    colours = ScalarMappable(Normalize(0.0, longest_s), "viridis_r")
    for axes, (name, domain) in zip(panels, found.items(), strict=False):
        turned = np.degrees(domain.turned_rad)
        shades = {"shading": "nearest", "norm": colours.norm, "cmap": colours.cmap}
        axes.pcolormesh(turned, domain.across_m, domain.settled_s, **shades)
        row, column = np.nonzero(domain.reversed_there)
        axes.plot(turned[column], domain.across_m[row], "x", color=COLOURS[0], markersize=5)
        axes.set_title(name)
        axes.set(xlabel="initial heading (°)", ylabel="initial offset (m)", xticks=(-180, -90, 0, 90, 180))
    for axes in panels[len(found) :]:
        axes.set_axis_off()
    for axes in panels[:-1]:
        axes.label_outer()
    figure.colorbar(colours, ax=panels.tolist(), label="s until within 2 cm for good; crosses: ends looking back")
    save(figure, path, DPI)


def _axes(axes: "Axes", x: str, y: str) -> None:
    axes.set(xlabel=x, ylabel=y)
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(color="#e3e6e4", linewidth=0.7)
    axes.set_axisbelow(True)
