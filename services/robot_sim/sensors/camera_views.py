"""Several cameras overhead: which of them sees a robot, and what hides it from the others."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel
from touchline.core.polygons import apart_squared
from touchline.core.records import Record
from touchline.onboard.interface import TICKS_PER_S
from touchline.schemas.scenario import Scenario
from touchline.services.robot_sim.sensors.zones import PlaceOutline, Zones, distance, make_zones

Floats = NDArray[np.float64]

NO_CAMERA: Final = -1


class CameraPlace(Record):
    """Camera, and the ground that it sees."""

    outline: PlaceOutline
    x_m: float
    y_m: float
    height_m: float
    off_x_m: float
    off_y_m: float
    off_rad: float
    edge_factor: float
    reach_m: float
    """Distance of its farthest corner from the place below it."""


class HidingPlace(Record):
    """Something upright, and when it is there."""

    outline: PlaceOutline
    height_m: float
    start_s: float
    end_s: float
    x_mps: float
    y_mps: float


class CameraViews(NamedTuple):
    """Cameras, of kind `CameraPlace`, and what hides robots from them, of kind `HidingPlace`."""

    cameras: Zones
    hiding: Zones
    tag_m: float
    """Height of a robot's tag."""


@kernel
def camera_that_sees(views: CameraViews, x: float, y: float, tick: int) -> int:
    """Return the number of the camera nearest to a robot of those that see it; NO_CAMERA: none.

    Args:
        views: Cameras.
        x: East, map frame [m].
        y: North, map frame [m].
        tick: Tick of the picture.
    """
    found, nearest_m = NO_CAMERA, math.inf
    for k in range(len(views.cameras.places)):
        camera = views.cameras.places[k]
        off_m = math.hypot(x - camera.x_m, y - camera.y_m)
        seen = off_m < nearest_m and distance(camera.outline, views.cameras.vertices, x, y) == 0.0
        if seen and not _is_hidden(views, k, x, y, tick):
            found, nearest_m = k, off_m
    return found


@kernel
def _is_hidden(views: CameraViews, number: int, x: float, y: float, tick: int) -> bool:
    """Return whether something stands between a camera and the tag of a robot."""
    camera, hiding, time_s = views.cameras.places[number], views.hiding, tick / TICKS_PER_S
    for k in range(len(hiding.places)):
        thing = hiding.places[k]
        if not thing.start_s <= time_s < thing.end_s or thing.height_m <= views.tag_m:
            continue
        east, north = thing.x_mps * (time_s - thing.start_s), thing.y_mps * (time_s - thing.start_s)
        share = min((thing.height_m - views.tag_m) / max(camera.height_m - views.tag_m, 1e-9), 1.0)
        tag = complex(x - east, y - north)
        top = tag + share * (complex(camera.x_m, camera.y_m) - complex(x, y))
        if _meets(thing.outline, hiding.vertices, tag, top):
            return True
    return False


@kernel
def _meets(outline: PlaceOutline, vertices: Floats, a: complex, b: complex) -> bool:
    """Return whether a segment meets a polygon."""
    if distance(outline, vertices, a.real, a.imag) == 0.0:
        return True
    last = outline.first + outline.count - 1
    before = complex(vertices[last, 0], vertices[last, 1])
    for index in range(outline.first, outline.first + outline.count):
        corner = complex(vertices[index, 0], vertices[index, 1])
        if apart_squared(a, b, before, corner) == 0.0:
            return True
        before = corner
    return False


@kernel
def noise_factor(camera: CameraPlace, x: float, y: float) -> float:
    """Return the factor on the white noise of a camera at a place [m]."""
    share = math.hypot(x - camera.x_m, y - camera.y_m) / max(camera.reach_m, 1e-9)
    return float(1.0 + (camera.edge_factor - 1.0) * share * share)


def views_of(scenario: Scenario) -> CameraViews:
    """Return the cameras of a scenario; none where one sees all the ground."""
    camera = scenario.camera
    cameras = [
        (
            each.view,
            (
                *(each.x_m, each.y_m, each.height_m, each.off_x_m, each.off_y_m, each.off_rad, each.edge_factor),
                max(math.hypot(x - each.x_m, y - each.y_m) for x, y in each.view),
            ),
        )
        for each in camera.cameras
    ]
    hiding = [
        (
            each.outline,
            (
                *(each.height_m, each.start_s, each.start_s + (each.duration_s or math.inf)),
                *(each.x_mps, each.y_mps),
            ),
        )
        for each in camera.hiding
    ]
    return CameraViews(make_zones(CameraPlace, cameras), make_zones(HidingPlace, hiding), camera.tag_height_m)
