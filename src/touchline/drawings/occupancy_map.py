"""Occupancy maps of Nav2 (YAML and an image) as known ground; whatever is not known to be free counts as occupied.

Cells become polygons by their edges. Polygons are simplified outward only: corners that point into what is occupied
are filled.
"""

from __future__ import annotations

import math
import struct
import warnings
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Final, Literal

import numpy as np
import shapely
from numpy.typing import NDArray
from PIL import Image, UnidentifiedImageError
from pydantic import ConfigDict, Field, ValidationError
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from touchline.schemas.errors import SpecError
from touchline.schemas.known_ground import KnownGround, KnownObstacle
from touchline.schemas.spec import Spec, problems_of, read_text

CELLS_MAX: Final = 25_000_000
"""Largest number of cells of a map."""
UNKNOWN: Final = 205
"""Grey value of unknown cells as Nav2 saves them, which its own free_thresh of 0.25 would take for free."""
# Depth (cells) of corners that are filled, pass by pass.
FILLED: Final = (0.8, 0.3, 0.3)
FORMATS: Final = ("PPM", "PNG", "BMP")
"""Formats of images that Nav2 writes, by Pillow's names, of which the first has PGM."""
NAMED: Final = "PGM, PNG or BMP"
TOO_LARGE: Final = f"give at most {CELLS_MAX} cells"
DAMAGED: Final = (ValueError, SyntaxError, EOFError, struct.error, zlib.error)
"""Errors that Pillow raises besides its own."""
DEEP: Final = ("I", "I;16")
"""Modes of grey images of 16 bits."""

Cells = NDArray[np.bool_]


class MapFile(Spec):
    """The YAML file of a map."""

    model_config = ConfigDict(extra="ignore")

    image: Annotated[str, Field(min_length=1)]
    """File of the image, from the folder of the YAML file."""
    resolution: Annotated[float, Field(gt=0.0, le=10.0)]
    """Side of a cell, m."""
    origin: tuple[float, float, float]
    """x (m), y (m) and yaw (rad) of the image's lower left corner in the map frame."""
    negate: Annotated[int, Field(ge=0, le=1)] = 0
    """1: white is occupied."""
    occupied_thresh: Annotated[float, Field(ge=0.0, le=1.0)] = 0.65
    """Occupancy above which a cell is occupied."""
    free_thresh: Annotated[float, Field(ge=0.0, le=1.0)] = 0.25
    """Occupancy below which a cell is free."""
    mode: Literal["trinary", "scale", "raw"] = "trinary"
    """`raw`: the image holds the occupancy in per cent."""


def load_map(path: Path) -> KnownGround:
    """Read a map.

    Args:
        path: The YAML file.

    Raises:
        SpecError: It or its image cannot be read, or is no map.
    """
    described = _described(path)
    image = path.parent / described.image
    shade = _shades(image)
    occupancy = shade if described.negate else 1.0 - shade
    if described.mode == "raw":
        occupancy = 2.55 * shade
    free = occupancy < described.free_thresh  # nowhere if NaN
    if described.mode == "trinary" and not described.negate:
        free &= np.abs(shade * 255.0 - UNKNOWN) > 0.5
    if not free.any():
        raise SpecError(str(image), "", "has no free cell", "check negate and free_thresh in the YAML file")
    height, width = free.shape
    # The first row of the image is the highest in y.
    taken = _filled(_outlines(~free[::-1]))
    found = []
    for number, polygon in enumerate(shapely.get_parts(taken), 1):
        rings = [_placed(ring, described) for ring in (polygon.exterior, *polygon.interiors)]
        found.append(KnownObstacle(id=f"{image.name} {number}", corners=rings[0], holes=tuple(rings[1:])))
    boundary = _placed(shapely.box(0.0, 0.0, width, height).exterior, described)
    try:
        return KnownGround(boundary=boundary, obstacles=tuple(found))
    except ValidationError as error:
        raise SpecError(
            str(image), "", f"is too intricate: {error.errors()[0]['msg']}", "give a coarser map"
        ) from error


def _described(path: Path) -> MapFile:
    try:
        data = YAML(typ="safe").load(read_text(path))
    except YAMLError as error:
        raise SpecError(str(path), "", f"is no YAML: {str(error).splitlines()[0]}", "give a map of Nav2") from error
    if not isinstance(data, dict):
        raise SpecError(str(path), "", "is no map", "give image, resolution and origin")
    try:
        described = MapFile.model_validate({**data, "negate": int(data.get("negate", 0) or 0)})
    except (ValidationError, TypeError, ValueError) as error:
        if isinstance(error, ValidationError):
            raise problems_of(error, str(path), data, MapFile) from error
        raise SpecError(str(path), "negate", f"is {data['negate']!r}", "give 0 or 1") from error
    if described.free_thresh > described.occupied_thresh:
        raise SpecError(str(path), "free_thresh", "is above occupied_thresh", "give a lower one")
    return described


def _shades(image: Path) -> NDArray[np.float64]:
    """Shades (rows, columns) of an image, 0 black to 1 white, first row on top; NaN where it is transparent.

    Raises:
        SpecError: It cannot be read.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            with Image.open(image, formats=FORMATS) as opened:
                return _shades_of(opened, image)
    except UnidentifiedImageError as error:
        raise SpecError(str(image), "", f"is no image in {NAMED}", "convert it to one of these") from error
    except (Image.DecompressionBombError, Image.DecompressionBombWarning) as error:
        raise SpecError(str(image), "", "is far too large", TOO_LARGE) from error
    except OSError as error:
        if error.strerror:
            remedy = "check image in the YAML file"
            raise SpecError(str(image), "", f"cannot be read: {error.strerror}", remedy) from error
        raise SpecError(str(image), "", f"is damaged: {error}", "copy or save it again") from error
    except DAMAGED as error:
        raise SpecError(str(image), "", f"is damaged: {error}", "save it again") from error


def _shades_of(opened: Image.Image, image: Path) -> NDArray[np.float64]:
    if opened.width * opened.height > CELLS_MAX:
        raise SpecError(str(image), "", f"has {opened.width} x {opened.height} cells", TOO_LARGE)
    if opened.mode in DEEP:
        return np.asarray(opened, dtype=np.float64) / 65535.0
    colours = np.asarray(opened if opened.mode == "L" else opened.convert("RGBA"), dtype=np.float64) / 255.0
    if colours.ndim == 2:
        return colours
    return np.where(colours[..., 3] < 1.0, np.nan, colours[..., :3].mean(axis=2))


def _outlines(taken: Cells) -> Any:
    """Outlines of cells, in cells from the lower left corner; the first row is the lowest."""
    padded = np.zeros((taken.shape[0], taken.shape[1] + 2), np.int8)
    padded[:, 1:-1] = taken
    change = np.diff(padded, axis=1)
    rows, begins = np.nonzero(change == 1)
    _, ends = np.nonzero(change == -1)
    return shapely.union_all(shapely.box(begins, rows, ends, rows + 1))


def _filled(shape: Any) -> Any:
    """Fill shallow corners that point into a shape, and drop corners on straight lines."""
    for depth in FILLED:
        corners = [triangle for ring in _rings(shape) for triangle in _notches(ring, depth)]
        shape = shapely.simplify(shapely.union_all([shape, *corners]), 1e-9)
    return shape


def _rings(shape: Any) -> Iterator[NDArray[np.float64]]:
    """Rings (n, 2) of polygons with the inside on their left."""
    for polygon in shapely.get_parts(shape):
        oriented = shapely.orient_polygons(polygon)
        for ring in (oriented.exterior, *oriented.interiors):
            yield shapely.get_coordinates(ring)[:-1]


def _notches(ring: NDArray[np.float64], depth: float) -> list[shapely.Polygon]:
    """Triangles that fill the corners of a ring that point into it and are not deeper than `depth`."""
    before, after = np.roll(ring, 1, axis=0), np.roll(ring, -1, axis=0)
    (ax, ay), (bx, by) = (ring - before).T, (after - before).T
    twice = ax * by - ay * bx  # positive where the ring turns right at the corner: the inside is on the left
    deep = np.abs(twice) / np.maximum(np.hypot(bx, by), 1e-12)
    chosen = np.flatnonzero((twice < 0.0) & (deep <= depth))
    return [shapely.Polygon((before[k], ring[k], after[k])) for k in chosen]


def _placed(ring: Any, described: MapFile) -> tuple[tuple[float, float], ...]:
    """Corners of a ring of cells in the map frame (m)."""
    x_m, y_m, yaw = described.origin
    cells = shapely.get_coordinates(ring)[:-1] * described.resolution
    cos, sin = math.cos(yaw), math.sin(yaw)
    return tuple((x_m + cos * x - sin * y, y_m + sin * x + cos * y) for x, y in cells.tolist())
