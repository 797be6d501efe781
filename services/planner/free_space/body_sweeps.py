"""Compiled: is the ground free that a body sweeps, from pose to pose."""

import math

import numpy as np

from touchline.core.jit import kernel
from touchline.core.polygons import off_squared
from touchline.services.planner.free_space.wall_grid import WallGrid
from touchline.services.planner.geometry.clothoid import Floats, Ints

# Step of a turn on the spot (rad).
SPIN_STEP_RAD = math.radians(3.0)


@kernel
def swept_free(poses: Floats, corners: Floats, sizes: Ints, walls: WallGrid, slack_m: float) -> bool:
    """True if no wall is in the ground that a body sweeps from each pose to the next.

    That ground is the convex hull of each convex part at both poses, exact for straights, and `slack_m` round it, which
    covers what lies outside the hull if the motion turns between them. The first pose is taken to be free.

    Args:
        poses: (n, 3) x (m), y (m), heading (rad), in driving order.
        corners: (k, 2) corners of the convex parts, one part after the other, counter-clockwise, in the body's frame.
        sizes: (parts,) number of corners of each part.
        walls: Edges of the obstructed ground.
        slack_m: Growth of the hull (m).
    """
    largest = 0
    for k in range(len(sizes)):
        largest = max(largest, sizes[k])
    points, hull = np.empty((2 * largest, 2)), np.empty((4 * largest, 2))
    for p in range(max(1, len(poses) - 1)):
        a, b = poses[p], poses[min(p + 1, len(poses) - 1)]
        cos_a, sin_a, cos_b, sin_b = math.cos(a[2]), math.sin(a[2]), math.cos(b[2]), math.sin(b[2])
        first = 0
        for k in range(len(sizes)):
            size = sizes[k]
            for c in range(size):
                x, y = corners[first + c, 0], corners[first + c, 1]
                points[c, 0], points[c, 1] = a[0] + cos_a * x - sin_a * y, a[1] + sin_a * x + cos_a * y
                points[size + c, 0], points[size + c, 1] = b[0] + cos_b * x - sin_b * y, b[1] + sin_b * x + cos_b * y
            first += size
            count = _hull(points, 2 * size, hull)
            if _meets(hull, count, walls, slack_m):
                return False
    return True


@kernel
def _hull(points: Floats, count: int, hull: Floats) -> int:
    """Write the convex hull of points, counter-clockwise, and return its number of corners; the points are sorted.

    Andrew, "Another efficient algorithm for convex hulls in two dimensions", Information Processing Letters 9(5), 1979.
    """
    for i in range(1, count):
        x, y, j = points[i, 0], points[i, 1], i
        while j > 0 and (points[j - 1, 0] > x or (points[j - 1, 0] == x and points[j - 1, 1] > y)):
            points[j, 0], points[j, 1] = points[j - 1, 0], points[j - 1, 1]
            j -= 1
        points[j, 0], points[j, 1] = x, y
    n = 0
    for turn in range(2):
        base = n
        for i in range(count):
            q = i if turn == 0 else count - 1 - i
            x, y = points[q, 0], points[q, 1]
            while n >= base + 2:
                ax, ay, bx, by = hull[n - 2, 0], hull[n - 2, 1], hull[n - 1, 0], hull[n - 1, 1]
                if (bx - ax) * (y - ay) - (by - ay) * (x - ax) > 0.0:
                    break
                n -= 1
            hull[n, 0], hull[n, 1] = x, y
            n += 1
        n -= 1
    return int(n)


@kernel
def _meets(hull: Floats, count: int, walls: WallGrid, slack_m: float) -> bool:
    """True if a wall meets a convex polygon whose sides are moved outward by `slack_m`.

    Cyrus and Beck, "Generalized two- and three-dimensional clipping", Computers & Graphics 3(1), 1978.
    """
    left, low, right, high = math.inf, math.inf, -math.inf, -math.inf
    for i in range(count):
        left, right = min(left, hull[i, 0]), max(right, hull[i, 0])
        low, high = min(low, hull[i, 1]), max(high, hull[i, 1])
    left, low, right, high = left - slack_m, low - slack_m, right + slack_m, high + slack_m
    first_i, last_i = _cells(left, right, walls, 0)
    first_j, last_j = _cells(low, high, walls, 1)
    for i in range(first_i, last_i + 1):
        row = i * walls.shape[1]
        for k in range(walls.begins[row + first_j], walls.begins[row + last_j + 1]):
            edge = walls.edges[walls.within[k]]
            ax, ay, bx, by = edge[0], edge[1], edge[2], edge[3]
            if max(ax, bx) < left or min(ax, bx) > right or max(ay, by) < low or min(ay, by) > high:
                continue
            if _crosses(hull, count, edge, slack_m):
                return True
    return False


@kernel
def _cells(low_m: float, high_m: float, walls: WallGrid, axis: int) -> tuple[int, int]:
    """Return the first and the last cell along an axis that a span meets; the last is before the first for none."""
    first = math.floor((low_m - walls.low[axis]) / walls.side_m)
    last = math.floor((high_m - walls.low[axis]) / walls.side_m)
    if last < 0 or first >= walls.shape[axis]:
        return 0, -1
    return max(first, 0), min(last, walls.shape[axis] - 1)


@kernel
def _crosses(hull: Floats, count: int, edge: Floats, slack_m: float) -> bool:
    """True if an edge (4,) meets a convex polygon; see `_meets`."""
    enter, leave = 0.0, 1.0
    for i in range(count):
        j = i + 1 if i + 1 < count else 0
        nx, ny = hull[j, 1] - hull[i, 1], hull[i, 0] - hull[j, 0]
        limit = slack_m * math.sqrt(nx * nx + ny * ny)
        off = nx * (edge[0] - hull[i, 0]) + ny * (edge[1] - hull[i, 1]) - limit
        change = nx * (edge[2] - edge[0]) + ny * (edge[3] - edge[1])
        if change == 0.0:
            if off > 0.0:
                return False
        elif change > 0.0:
            leave = min(leave, -off / change)
        else:
            enter = max(enter, -off / change)
        if enter > leave:
            return False
    return True


@kernel
def drives_free(pairs: Floats, corners: Floats, sizes: Ints, walls: WallGrid) -> Ints:
    """Find the straights that the body can drive, forward or backward.

    Args:
        pairs: (n, 4) x₁ y₁ x₂ y₂: from where to where (m).
        corners: As of `swept_free`.
        sizes: As of `swept_free`.
        walls: As of `swept_free`.

    Returns:
        (n,) 1 for those free with the body's front ahead, plus 2 for those free with its rear ahead.
    """
    found = np.zeros(len(pairs), np.int64)
    poses = np.empty((2, 3))
    for k in range(len(pairs)):
        heading = math.atan2(pairs[k, 3] - pairs[k, 1], pairs[k, 2] - pairs[k, 0])
        for way in range(2):
            poses[0, 0], poses[0, 1], poses[1, 0], poses[1, 1] = pairs[k, 0], pairs[k, 1], pairs[k, 2], pairs[k, 3]
            poses[0, 2] = poses[1, 2] = heading + way * math.pi
            if swept_free(poses, corners, sizes, walls, 0.0):
                found[k] += 1 + way
    return found


@kernel
def headings_free(places: Floats, corners: Floats, sizes: Ints, walls: WallGrid, count: int) -> Floats:
    """Find the sectors of heading through which the body can turn on the spot.

    Args:
        places: (n, 2) where (m).
        corners: As of `swept_free`.
        sizes: As of `swept_free`.
        walls: As of `swept_free`.
        count: Number of sectors of a full turn; sector k is from k to k + 1 times their width.

    Returns:
        (n, count) 1.0 for a sector that is free throughout.
    """
    found = np.zeros((len(places), count))
    reach = 0.0
    for c in range(len(corners)):
        reach = max(reach, math.hypot(corners[c, 0], corners[c, 1]))
    width = math.tau / count
    slack = reach * (1.0 - math.cos(0.5 * width))
    poses = np.empty((2, 3))
    for p in range(len(places)):
        if _off_walls(places[p, 0], places[p, 1], reach + slack, walls) > reach + slack:
            found[p] = 1.0
            continue
        poses[:, 0], poses[:, 1] = places[p, 0], places[p, 1]
        for k in range(count):
            poses[0, 2], poses[1, 2] = k * width, (k + 1) * width
            if swept_free(poses, corners, sizes, walls, slack):
                found[p, k] = 1.0
    return found


@kernel
def turn_free(pose: Floats, turn_rad: float, corners: Floats, sizes: Ints, walls: WallGrid) -> bool:
    """True if the body can turn on the spot; the pose itself is taken to be free.

    Args:
        pose: (3,) x (m), y (m), heading (rad) before the turn.
        turn_rad: Signed angle (rad).
        corners: As of `swept_free`.
        sizes: As of `swept_free`.
        walls: As of `swept_free`.
    """
    steps = math.ceil(abs(turn_rad) / SPIN_STEP_RAD)
    if steps == 0:
        return True
    reach = 0.0
    for c in range(len(corners)):
        reach = max(reach, math.hypot(corners[c, 0], corners[c, 1]))
    if _off_walls(pose[0], pose[1], reach, walls) > reach:
        return True
    poses = np.empty((steps + 1, 3))
    for k in range(steps + 1):
        poses[k, 0], poses[k, 1], poses[k, 2] = pose[0], pose[1], pose[2] + turn_rad * k / steps
    return bool(swept_free(poses, corners, sizes, walls, reach * (1.0 - math.cos(0.5 * turn_rad / steps))))


@kernel
def _off_walls(x_m: float, y_m: float, most_m: float, walls: WallGrid) -> float:
    """Distance of a place from the walls (m), if it is `most_m` at most; else more than that."""
    least, point = math.inf, complex(x_m, y_m)
    first_i, last_i = _cells(x_m - most_m, x_m + most_m, walls, 0)
    first_j, last_j = _cells(y_m - most_m, y_m + most_m, walls, 1)
    for i in range(first_i, last_i + 1):
        row = i * walls.shape[1]
        for k in range(walls.begins[row + first_j], walls.begins[row + last_j + 1]):
            edge = walls.edges[walls.within[k]]
            least = min(least, off_squared(point, complex(edge[0], edge[1]), complex(edge[2], edge[3])))
    return math.sqrt(least)


@kernel
def off_walls(places: Floats, most_m: float, walls: WallGrid) -> Floats:
    """Find the distances (n,) of places (n, 2) from the walls (m), as far as they are `most_m` at most; else more."""
    found = np.empty(len(places))
    for p in range(len(places)):
        found[p] = _off_walls(places[p, 0], places[p, 1], most_m, walls)
    return found


@kernel
def legs_turns(
    legs: Floats, entry_rad: float, exit_rad: float, corners: Floats, sizes: Ints, walls: WallGrid
) -> Floats:
    """Find free turns on the spot for straights one after the other, which are checked, too.

    Args:
        legs: (n + 1, 3) place x (m), y (m) and, of the straight that ends there, direction: 1.0 forward, −1.0 backward;
            the first row's is not used.
        entry_rad: Heading before the first turn.
        exit_rad: Heading after the last turn; NaN: any.
        corners: As of `swept_free`.
        sizes: As of `swept_free`.
        walls: As of `swept_free`.

    Returns:
        (n + 1,) signed turn at each place (rad), the shorter one that is free; empty if something is not free.
    """
    n = len(legs) - 1
    turns, poses, heading = np.zeros(n + 1), np.empty((2, 3)), entry_rad
    for k in range(n + 1):
        wanted = exit_rad
        if k < n:
            wanted = math.atan2(legs[k + 1, 1] - legs[k, 1], legs[k + 1, 0] - legs[k, 0])
            if legs[k + 1, 2] < 0.0:
                wanted += math.pi
            poses[0, 0], poses[0, 1], poses[1, 0], poses[1, 1] = legs[k, 0], legs[k, 1], legs[k + 1, 0], legs[k + 1, 1]
            poses[:, 2] = wanted
            if not swept_free(poses, corners, sizes, walls, 0.0):
                return np.empty(0)
        if math.isnan(wanted):
            break
        turn = (wanted - heading + math.pi) % math.tau - math.pi
        poses[0, 0], poses[0, 1], poses[0, 2] = legs[k, 0], legs[k, 1], heading
        if not turn_free(poses[0], turn, corners, sizes, walls):
            turn -= math.copysign(math.tau, turn)
            if not turn_free(poses[0], turn, corners, sizes, walls):
                return np.empty(0)
        turns[k], heading = turn, heading + turn
    return turns


@kernel
def cheapest(first: Floats, offsets: Ints, targets: Ints, costs: Floats) -> tuple[Floats, Ints]:
    """Find the cheapest ways from several vertices of a graph to all.

    Dijkstra, "A note on two problems in connexion with graphs", Numerische Mathematik 1, 1959.

    Args:
        first: (n,) cost of beginning at a vertex; infinite where no way begins.
        offsets: (n + 1,) where the edges of each vertex begin in `targets`.
        targets: (m,) where each edge leads.
        costs: (m,) what it costs.

    Returns:
        (n,) cost of each vertex, and (n,) vertex before it, −1 where a way begins.
    """
    n = len(first)
    cost, before, done = first.copy(), np.full(n, -1, np.int64), np.zeros(n, np.int64)
    for _ in range(n):
        at, least = -1, math.inf
        for v in range(n):
            if done[v] == 0 and cost[v] < least:
                at, least = v, cost[v]
        if at < 0:
            break
        done[at] = 1
        for e in range(offsets[at], offsets[at + 1]):
            if least + costs[e] < cost[targets[e]]:
                cost[targets[e]] = least + costs[e]
                before[targets[e]] = at
    return cost, before
