"""Tags in pictures of overhead cameras, rendered and found again; where OpenCV is installed."""

from __future__ import annotations

import math

import numpy as np
import pytest

pytest.importorskip("cv2")

from touchline_research.network import tag_pictures as p

CAMERA = p.overhead(1.5, 1.5, 3.0, (0.02, -0.015, 0.03))
TAGS = {3: p.TagPose(1.0, 1.2, 0.7), 8: p.TagPose(2.6, 2.2, -2.9)}
PERSON = np.array([(0.6, 1.3), (1.0, 1.3), (1.0, 0.9), (0.6, 0.9)])


def test_poses_of_tags_are_those_that_were_rendered() -> None:
    seen = p.found(p.taken(CAMERA, TAGS, p.TAG_HEIGHT_M, np.random.default_rng(1)))
    assert seen.keys() == TAGS.keys()
    for number, pose in TAGS.items():
        assert p.pose_of(CAMERA, seen[number]) == pytest.approx(pose, abs=0.01)
        assert math.dist(p.pose_of(CAMERA, seen[number])[:2], pose[:2]) < 0.001


def test_on_the_floor_a_tag_would_seem_farther_out() -> None:
    seen = p.found(p.taken(CAMERA, TAGS, p.TAG_HEIGHT_M, np.random.default_rng(1)))
    on_floor = p.pose_of(CAMERA, seen[8], 0.0)
    out_m = math.dist(on_floor[:2], (1.5, 1.5)) - math.dist(TAGS[8][:2], (1.5, 1.5))
    assert out_m == pytest.approx(math.dist(TAGS[8][:2], (1.5, 1.5)) * 0.4 / 2.6, abs=0.003)


def test_a_camera_is_known_by_tags_on_the_floor() -> None:
    grid = [p.TagPose(1.5 + x, 1.5 + y, 0.0) for x in (-1.0, 0.0, 1.0) for y in (-0.8, 0.8)]
    known = p.calibrated(CAMERA, grid, np.random.default_rng(2))
    assert known.place == pytest.approx(CAMERA.place, abs=0.005)
    assert known.rotation == pytest.approx(CAMERA.rotation, abs=0.002)


def test_a_tag_behind_somebody_is_not_found() -> None:
    seen = p.found(p.taken(CAMERA, TAGS, p.TAG_HEIGHT_M, np.random.default_rng(1), hidden=PERSON))
    assert seen.keys() == {8}
