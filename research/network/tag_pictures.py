"""Overhead cameras of the study's test bed as pictures: tags on robots are rendered, found and turned into poses.

The study has two cameras and a base station that publishes each robot's pose; it names no tags and no figures. Here the
tags are AprilTags (36h11) on the robots, found by OpenCV, and the base station knows each camera's place from a picture
of tags on the floor at known places. A tag is higher than the floor, so its place is looked for at its height: on the
floor it would be a tenth of its distance from the camera farther out.

Needs OpenCV: `pip install './research[tags]'`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Final, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Picture = NDArray[np.uint8]

TAG_HEIGHT_M: Final = 0.4
TAG_M: Final = 0.15
"""Side of a tag's black square; a white rim of one of its eight modules is outside."""
_MODULES: Final = 8
_MODULE_PX: Final = 16
_FINER: Final = 4
"""Pictures are rendered with so many times as many pixels along each side, and averaged."""
_FLOOR: Final = 110.0
_BLUR_PX: Final = 0.7
_NOISE: Final = 6.0
"""Blur and noise (grey levels of 255, 1 σ) of a picture (assumed)."""
_REFERENCES: Final = 100
"""Number of the first tag on the floor."""


class TagPose(NamedTuple):
    """Pose of a tag in the map frame (m, rad); its forward side is to the right in its picture."""

    x_m: float
    y_m: float
    heading_rad: float


class PinholeCamera(NamedTuple):
    """Camera without distortion.

    Attributes:
        focal_px: Focal length.
        size_px: Width and height of its pictures.
        rotation: (3, 3) from the map frame to its own: right, down, ahead.
        place: (3,) of its lens in the map frame (m).
    """

    focal_px: float
    size_px: tuple[int, int]
    rotation: Floats
    place: Floats

    @property
    def matrix(self) -> Floats:
        """(3, 3) from directions in its frame to pixels, whose centres are whole numbers."""
        width, height = self.size_px
        focal = self.focal_px
        return np.array([(focal, 0.0, 0.5 * (width - 1)), (0.0, focal, 0.5 * (height - 1)), (0.0, 0.0, 1.0)])

    def plane(self, height_m: float) -> Floats:
        """Return (3, 3) from places x, y, 1 (m) at a height to pixels."""
        columns = np.column_stack((self.rotation[:, :2], self.rotation @ (np.array((0.0, 0.0, height_m)) - self.place)))
        found: Floats = self.matrix @ columns
        return found

    def pixels(self, points: Floats, height_m: float) -> Floats:
        """Return (n, 2) pixels of places (n, 2) at a height (m)."""
        return _mapped(self.plane(height_m), points)


def overhead(x_m: float, y_m: float, height_m: float, tilt_rad: tuple[float, float, float]) -> PinholeCamera:
    """Return a camera of 1280 × 960 pixels that looks down, but for small turns about the axes x, y, z."""
    down = np.diag((1.0, -1.0, -1.0))
    turned: Floats = cv2.Rodrigues(np.array(tilt_rad))[0]
    return PinholeCamera(900.0, (1280, 960), turned @ down, np.array((x_m, y_m, height_m)))


def taken(
    camera: PinholeCamera,
    tags: Mapping[int, TagPose],
    height_m: float,
    rng: np.random.Generator,
    hidden: Floats | None = None,
) -> Picture:
    """Return the picture of tags.

    Args:
        camera: The camera.
        tags: By their numbers.
        height_m: Height of all.
        rng: Noise of the picture.
        hidden: (c, 2) corners of ground that something hides (m).
    """
    width, height = camera.size_px
    finer = np.array([(_FINER, 0.0, 0.5 * (_FINER - 1)), (0.0, _FINER, 0.5 * (_FINER - 1)), (0.0, 0.0, 1.0)])
    scene = np.full((_FINER * height, _FINER * width), _FLOOR, dtype=np.float32)
    for number, pose in tags.items():
        image = _tag(number)
        to_scene = finer @ camera.plane(height_m) @ _placed(pose) @ _metres(len(image))
        box = _box(_mapped(to_scene, _corners_px(len(image))), scene.shape)
        if box is None:
            continue
        (left, top), (right, bottom) = box
        shifted = np.array([(1.0, 0.0, -left), (0.0, 1.0, -top), (0.0, 0.0, 1.0)]) @ to_scene
        size = (right - left, bottom - top)
        drawn = cv2.warpPerspective(image, shifted, size, borderMode=cv2.BORDER_CONSTANT, borderValue=-1.0)
        part = scene[top:bottom, left:right]
        part[drawn >= 0.0] = drawn[drawn >= 0.0]
    if hidden is not None:
        cv2.fillConvexPoly(scene, np.rint(_mapped(finer, camera.pixels(hidden, 0.0))).astype(np.int32), 40.0)
    seen: Floats = cv2.GaussianBlur(cv2.resize(scene, (width, height), interpolation=cv2.INTER_AREA), (0, 0), _BLUR_PX)
    noisy = np.clip(np.rint(seen + rng.normal(0.0, _NOISE, seen.shape)), 0, 255)
    return noisy.astype(np.uint8)


def found(picture: Picture) -> dict[int, Floats]:
    """Return the corners (4, 2) of each tag in a picture (pixels), from its upper left one clockwise, by its number."""
    settings = cv2.aruco.DetectorParameters()
    settings.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    detector: Any = cv2.aruco.ArucoDetector(_family(), settings)
    corners, numbers, _ = detector.detectMarkers(picture)
    if numbers is None:
        return {}
    flat = np.ravel(numbers).tolist()
    return {int(each): np.reshape(where, (4, 2)).astype(float) for each, where in zip(flat, corners, strict=True)}


def calibrated(
    camera: PinholeCamera, references: Sequence[TagPose], rng: np.random.Generator, doubt_m: float = 0.0
) -> PinholeCamera:
    """Return a camera as the base station knows it: its place and rotation from a picture of tags on the floor.

    Args:
        camera: The real one, of which only focal length and size are known.
        references: Tags on the floor, at known places.
        rng: Noise of the picture, and of the known places.
        doubt_m: Error of the known places, 1 σ an axis.
    """
    tags = {_REFERENCES + number: pose for number, pose in enumerate(references)}
    seen = found(taken(camera, tags, 0.0, rng))
    known = [number for number in tags if number in seen]
    off = rng.normal(0.0, doubt_m, (len(known), 2))
    places = np.concatenate([_mapped(_placed(tags[number]), _corners_m()) + off[k] for k, number in enumerate(known)])
    pixels = np.concatenate([seen[number] for number in known])
    flat = np.column_stack((places, np.zeros(len(places))))
    _, turn, shift = cv2.solvePnP(flat, pixels, camera.matrix, np.zeros(4))
    rotation: Floats = cv2.Rodrigues(turn)[0]
    return camera._replace(rotation=rotation, place=-(rotation.T @ np.ravel(shift)))


def pose_of(camera: PinholeCamera, corners: Floats, height_m: float = TAG_HEIGHT_M) -> TagPose:
    """Return the pose of a tag at a height (m) by the pixels of its corners (4, 2)."""
    upper_left, upper_right, lower_right, lower_left = _mapped(
        np.linalg.inv(camera.plane(height_m)).astype(np.float64), corners
    )
    ahead = upper_right - upper_left + lower_right - lower_left
    x, y = 0.25 * (upper_left + upper_right + lower_right + lower_left)
    return TagPose(float(x), float(y), math.atan2(ahead[1], ahead[0]))


def _family() -> Any:
    return cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)


def _tag(number: int) -> NDArray[np.float32]:
    """Return the picture of a tag with its white rim (grey levels)."""
    black = cv2.aruco.generateImageMarker(_family(), number, _MODULES * _MODULE_PX)
    return np.pad(black, _MODULE_PX, constant_values=255).astype(np.float32)


def _metres(pixels: int) -> Floats:
    """Return (3, 3) from pixels of a tag's picture, rim included, to metres: right is ahead, up is left."""
    pixel_m = TAG_M / (_MODULES * _MODULE_PX)
    middle = 0.5 * (pixels - 1)
    return np.array([(pixel_m, 0.0, -middle * pixel_m), (0.0, -pixel_m, middle * pixel_m), (0.0, 0.0, 1.0)])


def _placed(pose: TagPose) -> Floats:
    """Return (3, 3) from metres of a tag to the map frame."""
    c, s = math.cos(pose.heading_rad), math.sin(pose.heading_rad)
    return np.array([(c, -s, pose.x_m), (s, c, pose.y_m), (0.0, 0.0, 1.0)])


def _corners_m() -> Floats:
    """Return (4, 2) corners of a tag's black square (m), from its upper left one clockwise."""
    half = 0.5 * TAG_M
    return np.array([(-half, half), (half, half), (half, -half), (-half, -half)])


def _corners_px(pixels: int) -> Floats:
    """Return (4, 2) corners of a tag's picture, rim included."""
    low, high = -0.5, pixels - 0.5
    return np.array([(low, low), (high, low), (high, high), (low, high)])


def _box(corners: Floats, shape: tuple[int, ...]) -> tuple[tuple[int, int], tuple[int, int]] | None:
    """Return the pixels round corners (4, 2) that are within a picture of a shape: from, to; None if none are."""
    left, top = np.maximum(np.floor(corners.min(axis=0)).astype(int), 0).tolist()
    most = np.array((shape[1], shape[0]))
    right, bottom = np.minimum(np.ceil(corners.max(axis=0)).astype(int) + 1, most).tolist()
    return None if left >= right or top >= bottom else ((left, top), (right, bottom))


def _mapped(homography: Floats, points: Floats) -> Floats:
    """Return points (n, 2) by a homography (3, 3)."""
    lifted = np.column_stack((points, np.ones(len(points)))) @ homography.T
    flat: Floats = lifted[:, :2] / lifted[:, 2:]
    return flat
