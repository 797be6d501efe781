"""Compiled: shortest path of bounded curvature from a pose to a point, with any heading there.

It is an arc and its tangent line, or two arcs: see `shortest_to_point`. (The shortest to a point must be the least of
Dubins' six words over all headings, of which at a free end only these are left: Boissonnat, Bui, "Accessibility region
for a car that only moves forwards along optimal paths", INRIA 2181, 1994.)
"""

import math

from touchline.core.angles import TAU
from touchline.core.jit import kernel

# An arc this close below a full turn (rad) is zero with a rounding error.
WRAP_RAD = 1e-12


@kernel
def shortest_to_point(goal: complex, radius: float) -> tuple[float, float, float, float]:
    """Find the shortest path from the origin, heading along +x, to a point.

    Per side s the first turning circle is about c = isR. With D = |g − c|: outside it, an arc up to the tangent through
    g; and from R to 3R, an arc up to a second circle through g that touches the first: its centre is 2R from c and R
    from g, so A = (3R² + D²)/(2D) along the line to g and √(4R² − A²) to either side of it.

    Args:
        goal: x + iy (m).
        radius: Radius R of the turning circle (m).

    Returns:
        Turn of the first arc (rad, left positive), line (m), turn of the second arc (rad), and total length (m).
    """
    best = (0.0, 0.0, 0.0, math.inf)
    for side in (1.0, -1.0):
        centre = complex(0.0, side * radius)
        to_goal = goal - centre
        distance = abs(to_goal)
        bearing = math.atan2(to_goal.imag, to_goal.real)
        if distance >= radius:
            line = math.sqrt(max(distance * distance - radius * radius, 0.0))
            first = _turn(side * (bearing - side * math.acos(radius / distance)) + 0.5 * math.pi)
            length = radius * first + line
            if length < best[3]:
                best = (side * first, line, 0.0, length)
        if radius <= distance <= 3.0 * radius:
            along = (3.0 * radius * radius + distance * distance) / (2.0 * distance)
            across = math.sqrt(max(4.0 * radius * radius - along * along, 0.0))
            for other in (across, -across):
                touch = bearing + math.atan2(other, along)
                second_centre = centre + 2.0 * radius * complex(math.cos(touch), math.sin(touch))
                seen = goal - second_centre
                first = _turn(side * touch + 0.5 * math.pi)
                last = _turn(-side * (math.atan2(seen.imag, seen.real) - touch - math.pi))
                length = radius * (first + last)
                if length < best[3]:
                    best = (side * first, 0.0, -side * last, length)
    return best


@kernel
def _turn(angle: float) -> float:
    """Wrap an angle to [0, 2π); a rounding error short of a full turn counts as 0."""
    turn = angle % TAU
    return 0.0 if turn > TAU - WRAP_RAD else turn
