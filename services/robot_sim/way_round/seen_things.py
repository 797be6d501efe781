"""Things that a robot sees and its plan does not know, as named outlines."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from touchline.schemas.template import Polygon

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from touchline.onboard import Onboard

UNTRACKED: Final = "something"
"""Name of a thing in the way of which there is no track."""
UNTRACKED_M: Final = 0.15
"""Radius of its outline."""
AT_M: Final = 0.3
"""Largest distance of a point in the way from the outline that it belongs to."""
SEEN_AGAIN_M: Final = 5.0
"""Distance from the robot within which it sees what stands there, if it still does."""
_CORNERS: Final = 8


class SeenThings:
    """Things that a robot has seen on a job and its plan does not know.

    One that stood is remembered until the robot comes near and does not see it any more: a robot that forgets what
    stands at one end of the field goes to and fro between that and something at the other end.
    """

    def __init__(self) -> None:
        self._earlier: list[Polygon] = []

    def look(self, onboard: Onboard, known: Sequence[Polygon]) -> list[Polygon]:
        """Return what the robot sees, as `seen_things`, and what it remembers."""
        import shapely

        seen, robot = seen_things(onboard, known), shapely.Point(onboard.estimate[:2])
        shapes = [shapely.Polygon(each.corners) for each in seen]
        remembered = list[Polygon]()
        for each in self._earlier:
            shape = shapely.Polygon(each.corners)
            if shape.distance(robot) > SEEN_AGAIN_M and not any(shape.distance(other) <= AT_M for other in shapes):
                remembered.append(each)
        names = [each.id for each in seen]
        for k, each in enumerate(remembered):
            remembered[k] = each.model_copy(update={"id": _unused(each.id, names)})
            names.append(remembered[k].id)
        moving = onboard.blocked is not None and onboard.blocked.moving
        walker = thing_in_the_way(onboard, seen) if moving else ""
        self._earlier = [*remembered, *(each for each in seen if each.id != walker)]
        return [*seen, *remembered]

    def forget(self) -> None:
        """Forget all that is not seen now."""
        self._earlier = []


def _unused(name: str, names: Collection[str]) -> str:
    """Return a name with the least number behind it that makes it new; unchanged if it is."""
    bare, number, found = name.split(" (earlier")[0], 1, name
    while found in names:
        found = f"{bare} (earlier)" if number == 1 else f"{bare} (earlier {number})"
        number += 1
    return found


def seen_things(onboard: Onboard, known: Sequence[Polygon]) -> list[Polygon]:
    """Return outlines of what stands near a robot, and of what is in its way, each by its kind and number.

    Things that move are not among them unless one is in the way: they will be elsewhere. An outline of the plan is
    among them if the robot may not pass it as near as planned.

    Args:
        onboard: The robot's computer.
        known: Outlines that the plan knows.
    """
    import shapely

    blocked, perception = onboard.blocked, onboard.perception
    if perception is None:
        return []
    tracks = [
        (each.moving, Polygon(id=f"{each.kind} {each.number}", corners=_corners(each.outline_m.tolist())))
        for each in perception.tracks
    ]
    standing = [outline for moving, outline in tracks if not moving]
    if blocked is None:
        return standing
    place = shapely.Point(blocked.place_m)
    near = [(float(shapely.Polygon(outline.corners).distance(place)), moving, outline) for moving, outline in tracks]
    off_m, moving, nearest = min(near, key=lambda each: each[0], default=(math.inf, False, None))
    if nearest is not None and off_m <= AT_M:
        return [*standing, nearest] if moving else standing
    for each in known:
        if shapely.Polygon(each.corners).distance(place) <= AT_M:
            return [*standing, each.model_copy(update={"id": f"{each.id} (seen)"})]
    x, y = blocked.place_m
    turns = [2.0 * math.pi * k / _CORNERS for k in range(_CORNERS)]
    ring = [(x + UNTRACKED_M * math.cos(turn), y + UNTRACKED_M * math.sin(turn)) for turn in turns]
    return [*standing, Polygon(id=UNTRACKED, corners=tuple(ring))]


def thing_in_the_way(onboard: Onboard, seen: Sequence[Polygon]) -> str:
    """Return the name of the outline in the robot's way; "" if nothing is."""
    import shapely

    blocked = onboard.blocked
    if blocked is None or not seen:
        return ""
    place = shapely.Point(blocked.place_m)
    return min(seen, key=lambda each: float(shapely.Polygon(each.corners).distance(place))).id


def _corners(outline_m: list[list[float]]) -> tuple[tuple[float, float], ...]:
    """Return the corners of a convex outline without repeated ones, which templates do not allow."""
    import shapely

    hull = shapely.MultiPoint(outline_m).convex_hull
    ring = shapely.get_coordinates(hull)[:-1].tolist() if hull.geom_type == "Polygon" else outline_m
    return tuple((x, y) for x, y in ring)
