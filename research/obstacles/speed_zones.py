"""Speed zones: rules that lower a robot's speed by where hits are, whatever moves; what ours is compared with."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel
from touchline.onboard import filter_model as m
from touchline.onboard.computer_state import Computer
from touchline.onboard.interface import TICK_S
from touchline.onboard.protection.way import CLEAR, IN_THE_WAY

Floats = NDArray[np.float64]

# Kinds of zones.
NO_ZONES: Final = 0
BOXES: Final = 1
CIRCLES: Final = 2
APPROACH: Final = 3
GROWING_CIRCLE: Final = 4

LEAST_HITS: Final = 4
"""Hits in a zone from which it acts, as Nav2 ships it."""
SLOWER: Final = 0.3
"""Share of the speed that is left in the slow zone, as Nav2 ships it."""
BESIDE_M: Final = 0.1
"""Distance by which boxes are wider than the body on each side."""


class SpeedZones(NamedTuple):
    """Zones round a robot, and what hits in them do.

    Attributes:
        kind: NO_ZONES: the robot's own protection; BOXES beside and ahead of the body; CIRCLES about its middle, which
            contain it; APPROACH: time to a contact with what stands ahead; GROWING_CIRCLE: what passive mode would
            allow a body that is such a circle.
        stop_m: Distance from the body within which a hit stops the robot; APPROACH, GROWING_CIRCLE: its margin.
        slow_m: Distance within which it slows the robot to SLOWER.
        ahead_s: Time that is kept to a contact (APPROACH).
    """

    kind: int = NO_ZONES
    stop_m: float = 0.0
    slow_m: float = 0.0
    ahead_s: float = 0.0


OWN_RULE: Final = SpeedZones()
"""No zones: the robot's own protection."""


@kernel
def _hits_in_reach(zones: SpeedZones, pose: tuple[float, float, float], body: Floats, points: Floats) -> Floats:
    """Return the LEAST_HITS least distances [m] of hits from the body, as the zones measure them, ascending."""
    front, back, wide, radius = -math.inf, math.inf, 0.0, 0.0
    for i in range(len(body)):
        front, back, wide = max(front, body[i, 0]), min(back, body[i, 0]), max(wide, abs(body[i, 1]))
    middle = 0.5 * (front + back)
    for i in range(len(body)):
        radius = max(radius, math.sqrt((body[i, 0] - middle) ** 2 + body[i, 1] ** 2))
    nearest = np.full(LEAST_HITS, math.inf)
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    for i in range(len(points)):
        east, north = points[i, 0] - pose[0], points[i, 1] - pose[1]
        ahead, left = cos * east + sin * north, cos * north - sin * east
        if zones.kind == CIRCLES or zones.kind == GROWING_CIRCLE:
            off = math.hypot(ahead - middle, left) - radius
        elif ahead > back and abs(left) < wide + BESIDE_M:
            off = max(ahead - front, 0.0)
        else:
            continue
        for k in range(LEAST_HITS):
            if off < nearest[k]:
                nearest[k], off = off, nearest[k]
    return nearest


@kernel
def watch_zones(computer: Computer, zones: SpeedZones, body: Floats, points: Floats) -> None:
    """Work out what zones allow after a scan: `limit_mps`, `cap_mps` and `blocked`.

    Args:
        computer: (1,) with the robot's pose; its way is updated.
        zones: The zones.
        body: (k, 2) outline of the body [m].
        points: (n, 2) hits, map frame [m].
    """
    c = computer[0]
    way, x = c.way, c.filter.states[c.times.tick % m.RING]
    off_m = _hits_in_reach(zones, (x[m.EAST], x[m.NORTH], x[m.HEADING]), body, points)
    allowed = way.fastest_mps
    if zones.kind == APPROACH:
        allowed = min(allowed, max(off_m[LEAST_HITS - 1] - zones.stop_m, 0.0) / zones.ahead_s)
    elif zones.kind == GROWING_CIRCLE:
        # The closed form of passive safety: the robot comes to rest before the nearest thing has come that far.
        b, thing = way.braking_mps2, way.thing_mps
        late_s = (way.late_ticks + 1) * TICK_S + way.reaction_s
        reached = b * late_s + thing
        left_m = off_m[0] - zones.stop_m - way.error_m - thing * (late_s + way.creep_s)
        allowed = min(allowed, max(math.sqrt(max(reached * reached + 2.0 * b * left_m, 0.0)) - reached, 0.0))
    elif off_m[LEAST_HITS - 1] < zones.stop_m:
        allowed = 0.0
    elif off_m[LEAST_HITS - 1] < zones.slow_m:
        allowed = SLOWER * way.fastest_mps
    way.limit_mps = way.cap_mps = allowed
    way.blocked = CLEAR if allowed > 0.0 else IN_THE_WAY
