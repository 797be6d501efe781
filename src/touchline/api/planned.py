"""Plans: `plan()`, and the `Plan` that it returns."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Self

import numpy as np
from numpy.typing import NDArray

from touchline.api.given_arguments import Progress, checked, no_progress, template_of, vehicle_of
from touchline.api.path_samples import path_samples, segment_table
from touchline.api.plan_options import PlanOptions
from touchline.core.stopwatch import Stopwatch
from touchline.onboard.trajectory.trajectory import LoadedTrajectory, load_trajectory
from touchline.recordings.writing import write_text
from touchline.schemas.cdr import encode
from touchline.schemas.errors import SpecError
from touchline.schemas.messages import PlanReport, Trajectory
from touchline.schemas.spec import EVERY_FIELD, Spec, parse, read_text
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner import plan as planning

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Colour = Literal["plain", "speed", "curvature"]


@dataclass(frozen=True, repr=False)
class Plan:
    """A planned template: the trajectory that a robot drives, and its figures.

    Attributes:
        template: The template.
        vehicle: The robot that it is planned for.
        options: Options of the plan.
        trajectory: Message that the robot is sent.
        report: Figures of the plan.
    """

    template: Template
    vehicle: Vehicle
    options: PlanOptions
    trajectory: Trajectory
    report: PlanReport

    @property
    def duration_s(self) -> float:
        """Time from start to standstill."""
        return self.report.total_time_s

    @property
    def length_m(self) -> float:
        """Length of the path."""
        return self._loaded.total_length_m

    @property
    def planning_time_s(self) -> float:
        """Wall-clock time that planning took."""
        return self.report.planning_time_s

    @property
    def hash(self) -> str:
        """Digest of the trajectory: equal plans have the same, on every machine that computes the same bits."""
        return hashlib.blake2b(encode(self.trajectory), digest_size=8).hexdigest()

    @cached_property
    def _loaded(self) -> LoadedTrajectory:
        return load_trajectory(self.trajectory, self.vehicle)

    @cached_property
    def segments(self) -> NDArray[np.void]:
        """Segments in driving order.

        (n,) with id, start_m, end_m, start_s, end_s, curvature_1pm, direction (±1, 0 on the spot), turn_rad, working.
        """
        return _read_only(segment_table(self._loaded))

    def path(self, step_m: float = 0.02) -> NDArray[np.void]:
        """Poses of the robot along the path, map frame (x east, y north, heading counter-clockwise from east).

        Args:
            step_m: Largest distance between two samples.

        Returns:
            (n,) with the fields time_s, station_m, x_m, y_m, heading_rad, speed_mps (negative backward),
            curvature_1pm (left positive), segment (row of `segments`) and working.

        Raises:
            SpecError: The step is not above 0.
        """
        if not step_m > 0.0:
            raise SpecError("Plan.path", "step_m", f"is {step_m}", "give metres above 0")
        return _read_only(path_samples(self._loaded, step_m))

    def at(self, time_s: float) -> np.void:
        """Row of `path` at a time, the nearest one to 2 cm.

        Args:
            time_s: Time since the start; the last row for any later one.
        """
        path = self.path()
        sample: np.void = path[min(int(np.searchsorted(path["time_s"], time_s)), len(path) - 1)]
        return sample

    def plot(self, ax: Axes | None = None, *, colour: Colour = "plain") -> Axes:
        """Draw the plan.

        Args:
            ax: Axes of matplotlib to draw into; None: those of a new figure.
            colour: By kind of line, speed or curvature.
        """
        from touchline.api.pictures import own_axes
        from touchline.services.planner.plots.plan_picture import draw_plan

        axes = own_axes(ax)
        draw_plan(axes, self._made, self.template, colour, self.vehicle)
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
        return axes

    def save(self, path: str | Path, /) -> None:
        """Write the plan to a JSON file, for `Plan.load`; or draw it, if the name ends in .svg, .png or .pdf.

        Raises:
            SpecError: The file cannot be written.
        """
        if Path(path).suffix in (".svg", ".png", ".pdf"):
            from touchline.recordings.writing import writing
            from touchline.services.planner.plots.plan_picture import plot_plan

            with writing(Path(path)):
                plot_plan(self._made, self.template, Path(path), "plain", self.vehicle)
            return
        write_text(_SavedPlan(**self.__getstate__()).model_dump_json(context=EVERY_FIELD) + "\n", Path(path))

    @classmethod
    def load(cls, path: str | Path, /) -> Self:
        """Read a plan that `save` wrote.

        Raises:
            SpecError: The file is not there, or no plan.
        """
        return cls(**dict(parse(_SavedPlan, read_text(Path(path)), str(path))))

    @cached_property
    def _made(self) -> planning.Plan:
        """The plan with its curves; made again for one that was loaded."""
        return planning.plan(self.template, self.vehicle, self.options.message())

    def __repr__(self) -> str:
        """One line: template, vehicle, time and length."""
        return f"Plan({self.template.name!r}, {self.vehicle.name!r}: {self.duration_s:.1f} s, {self.length_m:.1f} m)"

    def _repr_html_(self) -> str:
        from touchline.api.pictures import figure_html

        return figure_html(repr(self), self.plot)

    def __getstate__(self) -> dict[str, Any]:
        """Return the fields alone: the rest can be worked out again."""
        return {name: getattr(self, name) for name in self.__dataclass_fields__}


class _SavedPlan(Spec):
    """Content of a file."""

    template: Template
    vehicle: Vehicle
    options: PlanOptions
    trajectory: Trajectory
    report: PlanReport


def plan(
    template: Template | str | Path | Mapping[str, Any],
    /,
    *,
    vehicle: Vehicle | str | Path | None = None,
    options: PlanOptions | None = None,
    progress: Progress | None = None,
    stop: Callable[[], bool] | None = None,
    **changes: Any,
) -> Plan:
    """Plan the trajectory that paints or covers a template.

    Args:
        template: Template, its name or its file; see `load_template`.
        vehicle: Robot, its name or its file; None: the line marker.
        options: Options of the plan.
        progress: Called with the fraction done and the present step; may raise to end planning.
        stop: Returns whether to take the best order so far.
        **changes: Fields of `PlanOptions` that differ from `options`, such as `paint_speed_mps=0.8`.

    Raises:
        SpecError: Template, vehicle or an option cannot be used; names the field and the remedy.
        PlanningError: The template cannot be driven.
    """
    watch, report = Stopwatch(), progress or no_progress
    chosen = checked(PlanOptions, {**dict(options or PlanOptions()), **changes}, "plan")
    drawn, robot = template_of(template), vehicle_of(vehicle)
    made = planning.plan(
        drawn,
        robot,
        chosen.message(),
        lambda stage, fraction: report(fraction, f"Planning: {stage}"),
        stop or (lambda: False),
    )
    timed = made.report.model_copy(update={"planning_time_s": watch.elapsed_s})
    found = Plan(drawn, robot, chosen, made.trajectory, timed)
    found.__dict__["_made"] = made
    return found


def _read_only(table: NDArray[np.void]) -> NDArray[np.void]:
    table.flags.writeable = False
    return table
