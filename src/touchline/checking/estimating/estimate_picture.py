"""Picture of an estimator run: track over the reference, innovations, NIS, and error."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from touchline.checking.estimating.estimate_figures import CHI2_95
from touchline.checking.estimating.estimator_run import EstimatorRun
from touchline.checking.estimating.reference_frame import FrameFit, aligned
from touchline.onboard.filter_model import FIX_DOF
from touchline.recordings.writing import writing
from touchline.services.planner.plots.style import INK, plan_style, save

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ESTIMATE, REFERENCE, REJECTED, NORTHERN = "#1769aa", "#8a9a8f", "#d9480f", "#7b4fa3"
_SIZE_IN: Final = (13.0, 9.0)
_DPI: Final = 120


def draw_estimate(run: EstimatorRun, alignment: FrameFit, path: Path) -> None:
    """Draw the run to `path`, in the format of its suffix.

    Args:
        run: The finished run.
        alignment: Allowed difference of the reference's frame.
        path: File to write.

    Raises:
        SpecError: The file cannot be written.
    """
    from matplotlib.figure import Figure

    with plan_style(), writing(path):
        figure = Figure(figsize=_SIZE_IN, layout="constrained")
        track, innovations, nis, shares, error = figure.subplot_mosaic(
            [["track", "innovations"], ["track", "nis"], ["shares", "error"]], height_ratios=[1, 1, 1]
        ).values()
        _draw_track(track, run, alignment)
        _draw_innovations(innovations, run)
        _draw_nis(nis, run)
        _draw_shares(shares, run)
        _draw_error(error, run, alignment)
        save(figure, path, _DPI)


def _draw_track(axes: Axes, run: EstimatorRun, alignment: FrameFit) -> None:
    axes.set(aspect="equal", xlabel="east (m)", ylabel="north (m)", title="Track")
    if len(run.reference) and len(run.poses):
        place = aligned(run, alignment).place_m
        axes.plot(*place.T, color=REFERENCE, linewidth=2.5, label="truth" if run.emulated else "reference")
    elif len(run.receiver):
        there = run.receiver[run.receiver[:, 4] > 0]
        axes.plot(there[:, 1], there[:, 2], ".", color=REFERENCE, markersize=2, label="fixes")
    axes.plot(run.track[:, 1], run.track[:, 2], color=ESTIMATE, linewidth=0.8, label="estimate")
    rejected = run.fixes[run.fixes[:, 6] == 0]
    axes.plot(
        rejected[:, 1], rejected[:, 2], ".", color=REJECTED, markersize=2, label=f"{len(rejected):,} fixes rejected"
    )
    axes.legend(loc="best", fontsize=8)


def _draw_innovations(axes: Axes, run: EstimatorRun) -> None:
    axes.set(xlabel="time (s)", ylabel="innovation (m)", title="Innovations of fixes")
    for column, name, colour in ((3, "east", ESTIMATE), (4, "north", NORTHERN)):
        axes.plot(run.fixes[:, 0], run.fixes[:, column], ".", markersize=1.5, color=colour, label=name)
    for jump in run.jumps:
        axes.axvline(jump.time_s, color=REJECTED, linewidth=0.5)
    if len(run.fixes):
        axes.legend(loc="upper right", fontsize=8)
        most = 1.5 * float(np.percentile(np.abs(run.fixes[:, 3:5]), 99.5)) or 1.0
        axes.set_ylim(-most, most)


def _draw_nis(axes: Axes, run: EstimatorRun) -> None:
    axes.set(xlabel="time (s)", ylabel="NIS", title="NIS of fixes", yscale="log")
    used = run.fixes[:, 6] > 0
    nis = np.maximum(run.nis, 1e-3)
    axes.plot(run.fixes[used, 0], nis[used], ".", markersize=1.5, color=ESTIMATE, label="accepted")
    axes.plot(run.fixes[~used, 0], nis[~used], ".", markersize=1.5, color=REJECTED, label="rejected")
    axes.axhline(CHI2_95, color=INK, linewidth=0.8, label="95 % of χ² with 2 degrees of freedom")
    axes.legend(loc="lower right", fontsize=8)


def _draw_shares(axes: Axes, run: EstimatorRun) -> None:
    """Draw the share of fixes beyond each NIS, beside the expected one."""
    axes.set(xlabel="NIS", ylabel="share of fixes beyond", title="Distribution of NIS", xscale="log", yscale="log")
    grid = np.logspace(-1, 3, 200)
    axes.plot(grid, np.exp(-0.5 * grid), "--", color=REFERENCE, label="χ², 2 degrees of freedom")
    axes.plot(grid, (1.0 + grid / (FIX_DOF - 2.0)) ** (-0.5 * FIX_DOF), color=INK, label="Student-t, as assumed")
    if len(run.fixes):
        nis = np.sort(run.nis)
        axes.plot(nis, 1.0 - np.arange(len(nis)) / len(nis), color=ESTIMATE, label="as measured")
    axes.set(xlim=(0.1, 1000), ylim=(1e-4, 1.2))
    axes.legend(loc="lower left", fontsize=8)


def _draw_error(axes: Axes, run: EstimatorRun, alignment: FrameFit) -> None:
    axes.set(xlabel="time (s)", ylabel="error (m)", title="Distance of the estimate from the reference")
    if len(run.reference) and len(run.poses):
        compared = aligned(run, alignment)
        axes.plot(compared.time_s, np.hypot(*compared.error_m.T), color=ESTIMATE, linewidth=0.6)
    if len(run.track):
        axes.plot(run.track[:, 0], run.track[:, 4], color=INK, linewidth=0.8, label="σ of the estimate")
        axes.legend(loc="upper right", fontsize=8)
