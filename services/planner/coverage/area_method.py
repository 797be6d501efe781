"""Interfaces of area methods, one for tools that mark and one for tools that cover, and their choice by name."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Protocol

from touchline.schemas.curves import Curve
from touchline.schemas.errors import PlanningError
from touchline.schemas.messages import PlanOptions
from touchline.schemas.plugins import AREA_METHODS
from touchline.schemas.template import Area
from touchline.schemas.vehicles import ToolSpec
from touchline.services.planner.chosen_plugin import chosen

if TYPE_CHECKING:
    from touchline.services.planner.coverage.coverage_route import CoverageRoute
    from touchline.services.planner.coverage.coverage_task import CoverageTask

COVERING_DEFAULT: Final = "lap-and-lanes"
"""The method for a tool that covers, where the options name none."""


class AreaMethod(Protocol):
    """A function that covers an area with swaths, registered in `AREA_METHODS`."""

    def __call__(self, area: Area, width_m: float, /) -> Sequence[Curve]:
        """Return the lines and arcs along which the tool covers an area, in driving order and direction.

        Args:
            area: In the map frame; its outline and holes are simple polygons.
            width_m: Working width of the tool (m); somewhere the area is at least as wide.
        """


@dataclass(frozen=True)
class CoverageMethod:
    """Method for a tool that works wherever it passes, registered in `AREA_METHODS`.

    Attributes:
        cover: Plans the route over one area and reports the fraction done; raises `PlanningError` if there is none.
    """

    cover: Callable[[CoverageTask, Callable[[float], None]], CoverageRoute]


def area_method_name(options: PlanOptions, tool: ToolSpec) -> str:
    """Name of the area method in the options, or the tool's default."""
    return options.area_method or (COVERING_DEFAULT if tool.covers else AREA_METHODS.default)


def area_method_of(options: PlanOptions, tool: ToolSpec) -> AreaMethod | CoverageMethod:
    """Look up the area method that the options name; "" is the tool's default.

    Raises:
        PlanningError: There is no such method, or it is for other tools.
    """
    name = area_method_name(options, tool)
    found: AreaMethod | CoverageMethod = chosen(AREA_METHODS, name, "area method")
    if isinstance(found, CoverageMethod) and not tool.covers:
        problem = f'asks for the area method "{name}", which is for tools that work wherever they pass'
        raise PlanningError("", problem, f"use {AREA_METHODS.default}, or a vehicle with a roller")
    return found


def named_once(options: PlanOptions) -> PlanOptions:
    """Move an area method that the options give as `method` to `area_method`."""
    if options.method not in AREA_METHODS.names():
        return options
    return options.model_copy(update={"method": "", "area_method": options.method})
