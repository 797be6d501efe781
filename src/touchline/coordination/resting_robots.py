"""Silent robots at rest: where they may be, and how others keep off."""

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.cells import BufferedCell
from touchline.coordination.kernels.clipping import clip_all
from touchline.coordination.kernels.nearest import nearest_pair

Floats = NDArray[np.float64]


def where_it_rests(cell: BufferedCell, segment: Floats, within_m: float) -> Floats:
    """Return the region in which a robot may stand.

    Args:
        cell: The cell that it was using.
        segment: (4,) S, when it was last heard (m).
        within_m: Largest distance that it may have driven since; 0 if it was at rest already.

    Returns:
        (c, 2) corners of a convex polygon, counter-clockwise, or of a segment (m).
    """
    if within_m == 0.0 or not len(cell.corners):
        return segment.reshape(2, 2)
    x, y = segment[:2]
    box = np.array(((1.0, 0.0, x), (-1.0, 0.0, -x), (0.0, 1.0, y), (0.0, -1.0, -y)))
    box[:, 2] += within_m
    room = np.empty((2, len(cell.corners) + len(box), 2))
    count = clip_all(np.ascontiguousarray(cell.corners), len(cell.corners), box, room[0], room[1])
    return room[1, :count] if count else segment.reshape(2, 2)


def strip_off(segment: Floats, there: Floats, width_m: float) -> tuple[float, float, float, float]:
    """Return the strip beside a convex polygon that a robot keeps off; the whole width is the robot's.

    Args:
        segment: (4,) S of the robot (m).
        there: (c, 2) corners, counter-clockwise, or the ends of a segment (m).
        width_m: Width of the strip.

    Returns:
        Unit normal towards the polygon, and n·q at the strip's sides (m), the robot's first; a normal of (0, 0) if the
        robot's segment meets the polygon.
    """
    ends = there[:, 0] + 1j * there[:, 1]
    a, b = complex(segment[0], segment[1]), complex(segment[2], segment[3])
    pairs = [nearest_pair(a, b, c, d) for c, d in zip(ends.tolist(), np.roll(ends, -1).tolist(), strict=True)]
    mine, others = min(pairs, key=lambda pair: abs(pair[1] - pair[0]))
    gap = abs(others - mine)
    if gap == 0.0:
        return 0.0, 0.0, 0.0, 0.0
    normal = (others - mine) / gap
    at = normal.real * others.real + normal.imag * others.imag
    return normal.real, normal.imag, at - min(width_m, gap), at
