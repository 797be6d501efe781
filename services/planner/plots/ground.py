"""Plots of ground: polygons with holes, filled or outlined."""

from typing import TYPE_CHECKING

from touchline.core.robust_overlay import union
from touchline.schemas.template import Template

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from shapely.geometry.base import BaseGeometry

GROUND, MISSED, COVERED, TWICE = "#e9e4d8", "#d7301f", "#9c8466", "#77603f"
OBSTACLE, BOUNDARY, AREA_EDGE = "#3a3a3a", "#1f5fa8", "#4d4030"


def fill_ground(axes: "Axes", ground: "BaseGeometry", colour: str, name: str) -> None:
    """Fill polygons (m, map frame), one path with holes for each.

    Args:
        axes: Axes to draw on.
        ground: One or several polygons; other geometries are ignored.
        colour: Fill colour.
        name: Id in an SVG file.
    """
    import shapely
    from matplotlib.collections import PathCollection
    from matplotlib.path import Path as Outline

    outlines = []
    for part in shapely.get_parts(ground):
        if part.geom_type == "Polygon" and not part.is_empty:
            rings = [shapely.get_coordinates(ring) for ring in (part.exterior, *part.interiors)]
            outlines.append(Outline.make_compound_path(*(Outline(ring, closed=True) for ring in rings)))
    axes.add_collection(PathCollection(outlines, facecolors=colour, linewidths=0.0, gid=name))


def fill_obstacles(axes: "Axes", template: Template) -> None:
    """Fill the obstacles of a template, if it has any, with an entry in the legend.

    Args:
        axes: Axes to draw on.
        template: Template in the map frame.
    """
    import shapely

    if template.obstacles:
        fill_ground(axes, union([shapely.Polygon(each.corners) for each in template.obstacles]), OBSTACLE, "obstacles")
        axes.plot([], [], "s", color=OBSTACLE, label="obstacles")


def outline_ground(axes: "Axes", ground: "BaseGeometry", colour: str, style: str) -> None:
    """Draw the edges of polygons (m, map frame) in a colour and a line style of Matplotlib."""
    import shapely

    for line in shapely.get_parts(shapely.boundary(ground)):
        axes.plot(*shapely.get_coordinates(line).T, color=colour, linestyle=style, linewidth=1.0)
