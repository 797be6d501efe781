"""SVG picture of a template to scale: strokes at their painted width, areas, and boundary and obstacles dashed."""

import math
from collections.abc import Iterable
from html import escape

import numpy as np

from touchline.schemas.template import Position, Template, TemplateSegment

GRASS, PAINT, INK, FENCE = "#3f7d3a", "#ffffff", "#26332a", "#d9822b"
WIDTH_PX, MARGIN_SHARE, TITLE_PX, THINNEST_PX = 900.0, 0.04, 30.0, 0.6


def picture(template: Template) -> str:
    """Render a template as SVG text; the user unit is a pixel, and north is up."""
    low, high = bounds(template)
    margin = MARGIN_SHARE * float(max(high - low)) + template.line_width_m
    low, high = low - margin, high + margin
    scale = WIDTH_PX / float(max(high - low))
    width, height = (float(v) * scale for v in high - low)
    # A line thinner than this would not be seen: drawn wider than to scale.
    stroke = max(template.line_width_m * scale, THINNEST_PX)
    paths = "\n".join(f'<path d="{_path(segment, low, high, scale)}"/>' for segment in template.segments)
    areas = "".join(f'<path d="{_rings((a.outline, *a.holes), low, high, scale)}"/>\n' for a in template.areas)
    if areas:
        areas = f'<g fill="{PAINT}" fill-rule="evenodd">\n{areas}</g>\n'
    kept = [outline.corners for outline in (template.boundary, *template.obstacles) if outline is not None]
    fences = ""
    if kept:
        dashes = f'fill="none" stroke="{FENCE}" stroke-width="2" stroke-dasharray="8 5"'
        fences = f'\n<path {dashes} d="{_rings(kept, low, high, scale)}"/>'
    title = escape(template.title or template.name)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{height + TITLE_PX:.0f}" '
        f'viewBox="0 0 {width:.2f} {height + TITLE_PX:.2f}">\n'
        f'<text x="{width / 2:.1f}" y="20" text-anchor="middle" font-family="sans-serif" font-size="16" '
        f'fill="{INK}">{title}</text>\n'
        f'<g transform="translate(0 {TITLE_PX:.0f})">\n'
        f'<rect width="{width:.2f}" height="{height:.2f}" fill="{GRASS}"/>\n'
        f'{areas}<g fill="none" stroke="{PAINT}" stroke-width="{stroke:.3f}">\n{paths}\n</g>{fences}\n</g>\n</svg>\n'
    )


def bounds(template: Template) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest (x, y) of the strokes' centres and of the areas, m."""
    points = [np.array(area.outline) for area in template.areas]
    for segment in template.segments:
        curve = segment.curve()
        count = 2 if curve.curvature_1pm == 0 else 65
        x, y, _, _ = curve.at(np.linspace(0.0, curve.length_m, count))
        points.append(np.column_stack((x, y)))
    every = np.concatenate(points)
    return every.min(axis=0), every.max(axis=0)


def _rings(rings: Iterable[tuple[Position, ...]], low: np.ndarray, high: np.ndarray, scale: float) -> str:
    """Path data of closed outlines."""
    drawn = ((np.array(ring) - (low[0], high[1])) * (scale, -scale) for ring in rings)
    return "".join(f"M{'L'.join(f'{x:.3f} {y:.3f}' for x, y in ring.tolist())}Z" for ring in drawn)


def _path(segment: TemplateSegment, low: np.ndarray, high: np.ndarray, scale: float) -> str:
    def at(x: float, y: float) -> str:
        return f"{(x - low[0]) * scale:.3f} {(high[1] - y) * scale:.3f}"

    curve = segment.curve()
    if curve.curvature_1pm == 0.0:
        return f"M{at(curve.x_m, curve.y_m)}L{at(*curve.end[:2])}"
    # An SVG arc of half a turn or more is ambiguous: two halves never are.
    radius, turn = scale / abs(curve.curvature_1pm), abs(curve.curvature_1pm) * curve.length_m
    parts = 3 if turn > math.pi else 2
    sweep = 0 if curve.curvature_1pm > 0 else 1
    stations = np.linspace(0.0, curve.length_m, parts + 1)
    x, y, _, _ = curve.at(stations)
    arcs = "".join(f"A{radius:.3f} {radius:.3f} 0 0 {sweep} {at(*p)}" for p in zip(x[1:], y[1:], strict=True))
    return f"M{at(float(x[0]), float(y[0]))}{arcs}"
