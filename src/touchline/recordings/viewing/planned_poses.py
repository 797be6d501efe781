"""Plans converted to nav_msgs/Path."""

from __future__ import annotations

import math
from itertools import groupby
from typing import Final

import numpy as np

from touchline.recordings.viewing.markers import chords, headings, simplified
from touchline.schemas.curves import Curve, spin_rad
from touchline.schemas.frames import MAP_FRAME
from touchline.schemas.messages import (
    Header,
    LinearDirection,
    NavPath,
    Point,
    Pose,
    PoseStamped,
    Quaternion,
    Trajectory,
)

#: Largest distance of the poses' line from the plan; chords of arcs add as much again.
_TOLERANCE_M: Final = 0.01


def planned_poses(plan: Trajectory) -> NavPath:
    """Return poses along a plan, facing back where it is driven backward; turns on the spot have no length."""
    driven = [segment for segment in plan.path.segments if spin_rad(segment.curve) is None]
    header = Header(frame_id=MAP_FRAME)
    poses: list[PoseStamped] = []
    for direction, run in groupby(driven, key=lambda segment: segment.direction.value):
        stretches = [np.column_stack(chords(Curve.from_message(segment.curve), _TOLERANCE_M)) for segment in run]
        points = simplified(np.vstack(stretches), _TOLERANCE_M)
        turned_rad = math.pi if direction == LinearDirection.BACKWARD else 0.0
        for (x, y), heading in zip(points.tolist(), headings(points), strict=True):
            half_rad = (heading + turned_rad) / 2
            turn = Quaternion(z=math.sin(half_rad), w=math.cos(half_rad))
            poses.append(PoseStamped(header=header, pose=Pose(position=Point(x=x, y=y), orientation=turn)))
    return NavPath(header=header, poses=tuple(poses))
