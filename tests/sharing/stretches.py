"""Least distance ever of the stretches that robots claim, by their messages."""

import math
from collections.abc import Iterable
from itertools import combinations

import shapely

from touchline.jobs.shared.timed_path import body_disc
from touchline.schemas.messages import NavPath
from touchline.schemas.vehicles import Vehicle


def nearest_m(told: Iterable[tuple[str, NavPath]], vehicle: Vehicle) -> float:
    """The least room between bodies anywhere on the stretches that hold at the same time: what each robot told last."""
    middle, radius_m = body_disc(vehicle)
    now, nearest = {}, math.inf
    for robot, path in told:
        now[robot] = shapely.LineString([_carried(middle, each.pose) for each in path.poses])
        for one, other in combinations([line for line in now.values() if not line.is_empty], 2):
            nearest = min(nearest, one.distance(other) - 2.0 * radius_m)
    return nearest


def _carried(point, pose):
    """A point of the body at a pose."""
    cos, sin = (
        pose.orientation.w**2 - pose.orientation.z**2,
        2.0 * pose.orientation.w * pose.orientation.z,
    )
    return pose.position.x + cos * point[0] - sin * point[1], pose.position.y + sin * point[0] + cos * point[1]
