"""Hits of a scan, gathered by one kernel: what protection is to know of it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from touchline.core.arrays import copy_rows
from touchline.core.jit import borrowing
from touchline.onboard.perception.scan import GROUND, KNOWN, THING, Beams, ScanFigures
from touchline.onboard.perception.scan_memory import ScanMemory
from touchline.onboard.perception.unseen import unseen_edges

Floats = NDArray[np.float64]


@borrowing
def _gather(beams: Beams, kind: int, points: Floats, count: int) -> int:
    """Append the returns of a kind to points; return the number of points then."""
    for i in range(len(beams.kind)):
        if beams.kind[i] == kind:
            points[count, 0], points[count, 1] = beams.points_m[i]
            count += 1
    return count


@borrowing
def gather_hits(
    lidars: Sequence[ScanFigures], beams: Beams, memory: ScanMemory, most_unseen: int, points: Floats
) -> tuple[int, int, int]:
    """Gather the hits of a scan: missed returns, things, edges of unseen ground, known things, what may be ground.

    Args:
        lidars: (1,) data sheet.
        beams: The scan, with its kinds.
        memory: Memory of this lidar, with the returns that the scan has missed.
        most_unseen: Largest number of points on edges of unseen ground; 0: unseen ground is ignored.
        points: (2 · beams + `most_unseen`, 2) filled with their places, map frame [m].

    Returns:
        Number of points up to and without known things, up to the last of these, and of all.
    """
    count = int(memory.scans[2])
    copy_rows(memory.missed_m, points, count)
    count = _gather(beams, THING, points, count)
    if most_unseen > 0:
        count += unseen_edges(lidars, beams, points[count : count + most_unseen])
    known = _gather(beams, KNOWN, points, count)
    return count, known, _gather(beams, GROUND, points, known)
