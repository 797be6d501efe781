"""Plots of the study: curvature and wheel acceleration in a corner, and length against σ."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from touchline.services.planner.geometry.clothoid import Floats, Piece, PiecePath
from touchline.services.planner.plots.style import INK, save
from touchline_research.corner import LEG_M, corner_path
from touchline_research.driven_template import CONTESTANTS, Drive
from touchline_research.pitch import LENGTH_TARGETS, STUDY_SIGMA_1PM2, Pitch

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLOURS = {"DPP": "#8a8f98", "study CCD": "#d9480f", "ours": "#1769aa"}
STEP_M = 0.005
DPI = 130
BESIDE_M, RIGHT_ANGLE_RAD = 2.0, 1e-6


def plot_curvature(pitch: Pitch, path: Path) -> None:
    """Plot κ and the path of every planner's ideal curve in two corners: row 14's, and one of the goal area."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.0, 6.4), layout="constrained")
    curvature_axes, path_axes = figure.subplots(2, 2, height_ratios=(2, 3))
    for contestant in CONTESTANTS:
        _draw(corner_path(contestant, STUDY_SIGMA_1PM2), contestant.name, curvature_axes[0], path_axes[0])
        _draw(_pitch_corner(pitch.drive(contestant)), contestant.name, curvature_axes[1], path_axes[1])
    titles = (f"a right-hand corner, {LEG_M:g} m in and out", "a corner of the goal area: line, transition, line")
    for over, under, title in zip(curvature_axes, path_axes, titles, strict=True):
        _axes(over, "arc length (m)", "curvature (1/m)")
        _axes(under, "x (m)", "y (m)")
        over.set_title(title, fontsize=10)
        under.set_aspect("equal")
    curvature_axes[0].legend(frameon=False)
    figure.suptitle(f"Curvature in corners, σ_max = {STUDY_SIGMA_1PM2:g} m⁻²", fontsize=11, color=INK)
    save(figure, path, DPI)


def _draw(path: PiecePath, name: str, over: "Axes", under: "Axes") -> None:
    station = np.arange(0.0, path.length_m, STEP_M)
    x, y, _, curvature = path.sample(station)
    look = {"color": COLOURS[name], "linewidth": 1.8, "label": name, **_look(name)}
    over.plot(station, curvature, **look)
    under.plot(x, y, **look)


def _pitch_corner(drive: Drive) -> PiecePath:
    """First transition between two lines at right angles, with the adjacent metres of both."""
    for before, between, after in zip(drive.strokes, drive.transitions, drive.strokes[1:], strict=False):
        turn = math.remainder(after.begin.pose.heading_rad - before.end.pose.heading_rad, math.tau)
        straight = before.robot.curvature_1pm == after.robot.curvature_1pm == 0.0
        if (
            straight
            and abs(abs(turn) - 0.5 * math.pi) < RIGHT_ANGLE_RAD
            and abs(after.begin.pose.point - before.end.pose.point) < 1.0
        ):
            line = Piece(BESIDE_M)
            return PiecePath(before.end.pose.moved(-BESIDE_M + 0j, 0.0), (line, *between.pieces, line))
    raise ValueError("the field has no two lines that meet at a right angle")


def plot_acceleration(series: Mapping[str, tuple[Floats, Floats]], path: Path) -> None:
    """Plot the larger of both wheels' accelerations (rad/s²) of the emulated robot over time (s), by planner."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 3.6), layout="constrained")
    axes = figure.subplots()
    for name, (time, acceleration) in series.items():
        peak = float(acceleration.max())
        axes.plot(
            time - time[0],
            acceleration,
            color=COLOURS[name],
            label=f"{name}: peak {peak:.1f}",
            linewidth=1.5,
            **_look(name),
        )
    _axes(axes, "time since the corner's first leg (s)", "wheel acceleration (rad/s²)")
    axes.set_title("The emulated robot in the corner at 1.5 m/s (fine arcs): the wheel that accelerates harder")
    axes.legend(frameon=False)
    save(figure, path, DPI)


def plot_length(sigmas: Sequence[float], longer: Mapping[str, Sequence[float]], padded: float, path: Path) -> None:
    """Plot the excess length over DPP without padding against σ_max, with the targets."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 4.2), layout="constrained")
    axes = figure.subplots()
    for name, shares in longer.items():
        axes.plot(
            sigmas, 100.0 * np.asarray(shares), color=COLOURS[name], marker="o", markersize=4, linewidth=1.8, label=name
        )
    axes.axhline(100.0 * padded, color=COLOURS["DPP"], linewidth=1.4, label="DPP with its padding")
    for sigma, most in LENGTH_TARGETS:
        axes.plot(sigma, 100.0 * most, marker="v", color=INK, markersize=8, linestyle="none")
    axes.plot([], [], marker="v", color=INK, markersize=8, linestyle="none", label="ours must be at or below")
    axes.plot(
        (1.0, 2.1),
        (14.0, 8.0),
        marker="x",
        color=COLOURS["study CCD"],
        linestyle="none",
        label="as the study reports (its own pitch)",
    )
    _axes(axes, "σ_max (1/m²)", "longer than plain Dubins (%)")
    axes.set_title("The whole pitch, one order, κ_max = 1.125 1/m: length against sharpness")
    axes.set_ylim(bottom=0.0)
    axes.legend(frameon=False)
    save(figure, path, DPI)


def _look(name: str) -> dict[str, Any]:
    """Line style of a planner; at the study's σ its path in the corner is ours, so dashes over a line show both."""
    return {"linestyle": (0, (4, 3)), "zorder": 3} if name == "study CCD" else {"zorder": 2}


def _axes(axes: "Axes", x: str, y: str) -> None:
    axes.set(xlabel=x, ylabel=y)
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(color="#e3e6e4", linewidth=0.7)
    axes.set_axisbelow(True)
    axes.title.set_fontsize(10)
