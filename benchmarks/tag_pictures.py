"""Poses of tags in pictures of two overhead cameras, rendered and found again: errors, tags that are missed, overlap.

`python -m benchmarks tag_pictures`; `pictures` of each camera, with ten robots anywhere in 6 × 3 m, from seed `seed`.
Each camera's place is known from nine tags on the floor, whose places are known to `floor` m (1 σ an axis). Needs
OpenCV (`pip install './research[tags]'`).

The middle of a view is within 1.2 m of the place below the camera, the edge beyond. The last line is what the emulated
camera has by default, which the study does not tell.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from benchmarks._settings import Small
from touchline.schemas.scenario import CameraNoise
from touchline_research.network.tag_pictures import (
    TAG_HEIGHT_M,
    PinholeCamera,
    TagPose,
    calibrated,
    found,
    overhead,
    pose_of,
    taken,
)

ROBOTS: Final = 10
MIDDLE_M: Final = 1.2
CAMERAS: Final = (overhead(1.5, 1.5, 3.0, (0.02, -0.015, 0.03)), overhead(4.3, 1.5, 3.1, (-0.01, 0.02, -0.02)))
SMALL = Small(
    {"pictures": 4},
    (
        "4 pictures of each of 2 cameras, # robots",
        "middle # # # % # mm # °",
        "edge # # # % # mm # °",
        "0 tags with a wrong number",
        "both cameras: # robots, poses # mm and # ° from each other",
        "emulated by default: 10.0 mm 1.00 ° 2.0 % missed",
    ),
)


def main(pictures: int = 50, seed: int = 1, floor: float = 0.005) -> None:
    """Print a row for the middle and for the edge of views, and how far two cameras differ."""
    rng = np.random.default_rng(seed)
    known = [calibrated(camera, _references(camera), rng, floor) for camera in CAMERAS]
    rows = {"middle": list[tuple[float, float]](), "edge": list[tuple[float, float]]()}
    apart = list[tuple[float, float]]()
    visible = dict.fromkeys(rows, 0)
    wrong = 0
    for _ in range(pictures):
        robots = _anywhere(rng)
        poses = [_poses(camera, known[k], robots, rng) for k, camera in enumerate(CAMERAS)]
        for camera, seen in zip(CAMERAS, poses, strict=True):
            wrong += len(seen.keys() - robots.keys())
            for number, pose in robots.items():
                if not _is_whole(camera, pose):
                    continue
                where = "middle" if math.dist((pose.x_m, pose.y_m), camera.place[:2]) <= MIDDLE_M else "edge"
                visible[where] += 1
                if number in seen:
                    rows[where].append(_error(seen[number], pose))
        apart += [_error(poses[0][number], poses[1][number]) for number in poses[0].keys() & poses[1].keys()]
    print(f"{pictures} pictures of each of {len(CAMERAS)} cameras, {ROBOTS} robots")
    print("where    tags  found  missed  position, rms an axis  heading, rms")
    for where, errors in rows.items():
        off_m, off_rad = np.array(errors).reshape(-1, 2).T
        missed = 1.0 - len(errors) / max(visible[where], 1)
        print(
            f"{where:7}  {visible[where]:4}  {len(errors):5}  {100.0 * missed:4.1f} %  "
            f"{1e3 * _rms(off_m) / math.sqrt(2.0):18.2f} mm  {math.degrees(_rms(off_rad)):10.2f} °"
        )
    print(f"{wrong} tags with a wrong number")
    off_m, off_rad = np.array(apart).reshape(-1, 2).T
    both = f"{1e3 * _rms(off_m):.1f} mm and {math.degrees(_rms(off_rad)):.2f} °"
    print(f"both cameras: {len(apart)} robots, poses {both} from each other")
    assumed = CameraNoise()
    noise = f"{1e3 * assumed.white_m:.1f} mm {math.degrees(assumed.white_rad):.2f} °"
    print(f"emulated by default: {noise} {100.0 * assumed.dropout_share:.1f} % missed")


def _references(camera: PinholeCamera) -> list[TagPose]:
    """Tags on the floor: a grid of 3 × 3 about the place below a camera."""
    x_m, y_m, _ = camera.place.tolist()
    return [TagPose(x_m + 1.2 * column, y_m + 0.9 * row, 0.0) for column in (-1, 0, 1) for row in (-1, 0, 1)]


def _anywhere(rng: np.random.Generator) -> dict[int, TagPose]:
    """Robots at random places, none nearer than 0.4 m to another."""
    robots = dict[int, TagPose]()
    while len(robots) < ROBOTS:
        x_m, y_m, heading_rad = rng.uniform((0.0, 0.0, -math.pi), (6.0, 3.0, math.pi)).tolist()
        if all(math.dist((x_m, y_m), other[:2]) >= 0.4 for other in robots.values()):
            robots[len(robots)] = TagPose(x_m, y_m, heading_rad)
    return robots


def _poses(
    camera: PinholeCamera, known: PinholeCamera, robots: dict[int, TagPose], rng: np.random.Generator
) -> dict[int, TagPose]:
    """Poses that the base station finds in a picture."""
    picture = taken(camera, robots, TAG_HEIGHT_M, rng)
    return {number: pose_of(known, corners) for number, corners in found(picture).items()}


def _is_whole(camera: PinholeCamera, pose: TagPose) -> bool:
    """Return True if a tag with its rim is within the picture."""
    around = 0.14 * np.array([(1, 0), (-1, 0), (0, 1), (0, -1)]) + np.array(pose[:2])
    pixels = camera.pixels(around, TAG_HEIGHT_M)
    return bool((pixels >= 0.0).all() and (pixels <= np.array(camera.size_px)).all())


def _error(one: TagPose, other: TagPose) -> tuple[float, float]:
    """Differences of two poses: m, rad."""
    return math.dist(one[:2], other[:2]), math.remainder(one.heading_rad - other.heading_rad, math.tau)


def _rms(values: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(np.square(values)))) if len(values) else math.nan
