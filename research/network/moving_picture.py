"""Animated SVG of runs of teams from the same start, side by side, without a script.

Bodies are discs that are red while they touch another, thin lines are Voronoi cells.
"""

import math
from collections.abc import Sequence
from typing import Final, NamedTuple
from xml.etree import ElementTree as ET

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.cells import voronoi
from touchline.coordination.free_area import FreeArea
from touchline.services.planner.plots.style import INK
from touchline_research.network.team_trials import TeamRecord

Floats = NDArray[np.float64]

SHOWN_S: Final = 60.0
PACE: Final = 4.0
"""Sim time per time of the animation."""
PANEL_PX, HEAD_PX, FOOT_PX = 340.0, 64.0, 50.0
GAP_PX: Final = 36.0
"""Gap beside every panel, where robots outside their area are visible."""
BODY, TOUCHING, CELL = "#1769aa", "#e03131", "#9aa5a0"
CELLS_MOST: Final = 1_000
"""Maximum number of cells of a panel over all frames; with more robots, cells are drawn less often."""
FLASH_FRAMES: Final = 2
"""Minimum number of frames for which a contact is visible."""


class PanelSheet(NamedTuple):
    """Position and scale of a panel: left edge (px), px per metre, and its upper left corner in the map (m)."""

    left_px: float
    scale: float
    west_m: float
    north_m: float

    def place(self, x_m: float, y_m: float) -> str:
        """Convert a point of the map to the picture."""
        return (
            f"{self.left_px + self.scale * (x_m - self.west_m):.1f},{HEAD_PX + self.scale * (self.north_m - y_m):.1f}"
        )


def moving_picture(records: Sequence[TeamRecord]) -> str:
    """Render the animation as SVG.

    Args:
        records: One record for each panel, with areas of the same size.
    """
    frames = min(len(record.trace.times_s) for record in records)
    frames = min(frames, 1 + int(np.searchsorted(records[0].trace.times_s, SHOWN_S)))
    shown_s = records[0].trace.times_s[frames - 1]
    play = {"dur": f"{shown_s / PACE:.2f}s", "repeatCount": "indefinite"}
    width = len(records) * (PANEL_PX + GAP_PX) + GAP_PX
    sheets = [_sheet(record.area, GAP_PX + number * (PANEL_PX + GAP_PX)) for number, record in enumerate(records)]
    low = max(
        HEAD_PX + sheet.scale * float(np.ptp(r.area.hull[:, 1])) for sheet, r in zip(sheets, records, strict=True)
    )
    root = ET.Element("svg", xmlns="http://www.w3.org/2000/svg", viewBox=f"0 0 {width:.0f} {low + FOOT_PX:.0f}")
    root.set("font-family", "sans-serif")
    root.set("font-size", "13")
    ET.SubElement(root, "rect", width="100%", height="100%", fill="white")
    for record, sheet in zip(records, sheets, strict=True):
        _panel(root, record, sheet, frames, play)
    place = {"x": f"{GAP_PX:.0f}", "y": f"{low + 38.0:.0f}", "width": f"{width - 2 * GAP_PX:.0f}", "height": "3"}
    bar = ET.SubElement(root, "rect", place, fill=CELL)
    ET.SubElement(bar, "animate", {"attributeName": "width", "values": f"0;{place['width']}"} | play)
    _text(root, GAP_PX, low + 32.0, f"{shown_s:.0f} s, {PACE:g} times as fast as they drive", "11")
    return ET.tostring(root, encoding="unicode") + "\n"


def _sheet(area: FreeArea, left_px: float) -> PanelSheet:
    (west, south), (east, north) = area.hull.min(axis=0).tolist(), area.hull.max(axis=0).tolist()
    return PanelSheet(left_px, PANEL_PX / max(east - west, north - south), west, north)


def _panel(root: ET.Element, record: TeamRecord, sheet: PanelSheet, frames: int, play: dict[str, str]) -> None:
    places = np.array(record.trace.places[:frames])
    _text(root, sheet.left_px, 22.0, record.trial.rules.name, "15")
    _counter(root, sheet, record.trace.contacts[:frames], play)
    rings = (record.area.shape.exterior, *record.area.shape.interiors)
    outline = "".join(_closed(np.array(ring.coords)[:-1], sheet) for ring in rings)
    ET.SubElement(root, "path", d=outline, fill="none", stroke=INK)
    every = max(1, math.ceil(frames * places.shape[1] / CELLS_MOST))
    drawn = [_cells(each, record.area, sheet) for each in places[::every]]
    cells = ET.SubElement(root, "path", {"d": drawn[0], "fill": "none", "stroke": CELL, "stroke-width": "0.6"})
    times = ";".join(f"{number * every / (frames - 1):.4f}" for number in range(len(drawn)))
    changes = {"attributeName": "d", "calcMode": "discrete", "values": ";".join(drawn), "keyTimes": times}
    ET.SubElement(cells, "animate", changes | play)
    for track, red in zip(places.transpose(1, 0, 2), touching(record, frames).T, strict=True):
        _body(root, [sheet.place(x, y) for x, y in track.tolist()], red, sheet.scale * record.body_radius_m, play)


def touching(record: TeamRecord, frames: int) -> NDArray[np.bool_]:
    """Mark the robots that are drawn as touching another.

    Args:
        record: Record of the run.
        frames: Number of its updates, from the first one on.

    Returns:
        (frames, n) flags.
    """
    places = np.array(record.trace.places[:frames])
    apart = np.linalg.norm(places[:, :, None] - places[:, None], axis=3)
    apart[:, *np.diag_indices(places.shape[1])] = math.inf
    found: NDArray[np.bool_] = apart.min(axis=2) < 2.0 * record.body_radius_m
    for time_s, who in record.trace.touched:
        at = int(np.searchsorted(record.trace.times_s, time_s))
        found[at : at + FLASH_FRAMES, list(who)] = True
    return found


def _body(root: ET.Element, track: list[str], red: NDArray[np.bool_], radius_px: float, play: dict[str, str]) -> None:
    style = {"r": f"{radius_px:.1f}", "fill": BODY, "fill-opacity": "0.85", "transform": f"translate({track[0]})"}
    disc = ET.SubElement(root, "circle", style)
    moves = {"attributeName": "transform", "type": "translate", "values": ";".join(track)}
    ET.SubElement(disc, "animateTransform", moves | play)
    if red.any():
        _switched(disc, "fill", [TOUCHING if each else BODY for each in red.tolist()], play)


def _counter(root: ET.Element, sheet: PanelSheet, contacts: list[int], play: dict[str, str]) -> None:
    """Draw the number of contacts so far: a text for each number, of which one is visible at a time."""
    for count in sorted(set(contacts)):
        word = "contact" if count == 1 else "contacts"
        text = _text(root, sheet.left_px, 42.0, f"{count} {word}", "15", TOUCHING if count else INK)
        seen = ["visible" if each == count else "hidden" for each in contacts]
        text.set("visibility", seen[0])
        if len(set(seen)) > 1:
            _switched(text, "visibility", seen, play)


def _switched(element: ET.Element, attribute: str, values: list[str], play: dict[str, str]) -> None:
    """Animate an attribute in steps by its values, one per frame."""
    at = [0, *(k for k in range(1, len(values)) if values[k] != values[k - 1])]
    times = ";".join(f"{k / (len(values) - 1):.4f}" for k in at)
    attributes = {"attributeName": attribute, "calcMode": "discrete", "values": ";".join(values[k] for k in at)}
    ET.SubElement(element, "animate", attributes | {"keyTimes": times} | play)


def _cells(places: Floats, area: FreeArea, sheet: PanelSheet) -> str:
    parts = voronoi(places, area)
    corners = [some[:count] for some, count in zip(_flat(parts.corners), parts.counts.ravel(), strict=True) if count]
    return "".join(_closed(some, sheet) for some in corners)


def _flat(corners: Floats) -> Floats:
    return corners.reshape(-1, *corners.shape[2:])


def _closed(corners: Floats, sheet: PanelSheet) -> str:
    return "M" + " ".join(sheet.place(x, y) for x, y in corners.tolist()) + "Z"


def _text(root: ET.Element, x: float, y: float, words: str, size: str, fill: str = INK) -> ET.Element:
    text = ET.SubElement(root, "text", {"x": f"{x:.0f}", "y": f"{y:.0f}", "font-size": size, "fill": fill})
    text.text = words
    return text
