"""The study's plots: curvature and wheel acceleration round a corner, and length against σ."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from services.planner.clothoid import Floats
from services.planner.study.corner import LEG_M, corner_path
from services.planner.study.drive import CONTESTANTS
from services.planner.study.pitch import LENGTH_TARGETS, STUDY_SIGMA_1PM2

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLOURS = {"DPP": "#8a8f98", "study CCD": "#d9480f", "ours": "#1769aa"}
INK = "#26332a"
STEP_M = 0.005
DPI = 130


def plot_curvature(path: Path) -> None:
    """κ along row 14's corner, every planner's ideal curve."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 6.2), layout="constrained")
    over, under = figure.subplots(2, 1, height_ratios=(2, 3))
    for contestant in CONTESTANTS:
        corner = corner_path(contestant, STUDY_SIGMA_1PM2)
        station = np.arange(0.0, corner.length_m, STEP_M)
        x, y, _, curvature = corner.sample(station)
        look = {"color": COLOURS[contestant.name], "linewidth": 1.8, "label": contestant.name, **_look(contestant.name)}
        over.plot(station, curvature, **look)
        under.plot(x, y, **look)
    _axes(over, "arc length (m)", "curvature (1/m)")
    over.set_title(f"A right-hand corner, {LEG_M:g} m in and out: curvature, and the way (σ_max = {STUDY_SIGMA_1PM2:g} m⁻²)")
    _axes(under, "x (m)", "y (m)")
    under.set_aspect("equal")
    over.legend(frameon=False)
    _save(figure, path)


def plot_acceleration(series: Mapping[str, tuple[Floats, Floats]], path: Path) -> None:
    """Both wheels' larger acceleration (rad/s²) over time (s), of the emulated robot, by planner."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 3.6), layout="constrained")
    axes = figure.subplots()
    for name, (time, acceleration) in series.items():
        peak = float(acceleration.max())
        axes.plot(time - time[0], acceleration, color=COLOURS[name], label=f"{name}: peak {peak:.1f}", linewidth=1.5, **_look(name))
    _axes(axes, "time since the corner's first leg (s)", "wheel acceleration (rad/s²)")
    axes.set_title("The emulated robot in the corner at 1.5 m/s: the wheel that accelerates harder")
    axes.legend(frameon=False)
    _save(figure, path)


def plot_length(sigmas: Sequence[float], longer: Mapping[str, Sequence[float]], padded: float, path: Path) -> None:
    """How much longer than DPP without padding, against σ_max, with the targets."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 4.2), layout="constrained")
    axes = figure.subplots()
    for name, shares in longer.items():
        axes.plot(sigmas, 100.0 * np.asarray(shares), color=COLOURS[name], marker="o", markersize=4, linewidth=1.8, label=name)
    axes.axhline(100.0 * padded, color=COLOURS["DPP"], linewidth=1.4, label="DPP with its padding")
    for sigma, most in LENGTH_TARGETS:
        axes.plot(sigma, 100.0 * most, marker="v", color=INK, markersize=8, linestyle="none")
    axes.plot([], [], marker="v", color=INK, markersize=8, linestyle="none", label="ours must be at or below")
    axes.plot((1.0, 2.1), (14.0, 8.0), marker="x", color=COLOURS["study CCD"], linestyle="none", label="as the study reports (its own pitch)")
    _axes(axes, "σ_max (1/m²)", "longer than plain Dubins (%)")
    axes.set_title("The whole pitch, one order, κ_max = 1.125 1/m: length against sharpness")
    axes.set_ylim(bottom=0.0)
    axes.legend(frameon=False)
    _save(figure, path)


def _look(name: str) -> dict[str, object]:
    """At the study's σ, its way round the corner is ours: dashes over a line show both."""
    return {"linestyle": (0, (4, 3)), "zorder": 3} if name == "study CCD" else {"zorder": 2}


def _axes(axes: "Axes", x: str, y: str) -> None:
    axes.set(xlabel=x, ylabel=y)
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(color="#e3e6e4", linewidth=0.7)
    axes.set_axisbelow(True)
    axes.title.set_fontsize(10)


def _save(figure: object, path: Path) -> None:
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    assert isinstance(figure, Figure)
    with rc_context({"svg.hashsalt": "touchline"}):
        figure.savefig(path, dpi=DPI, metadata={"Date": None} if path.suffix == ".svg" else None)
