"""The work of a long chain, counted in calls and points rather than in seconds."""

import math
from itertools import pairwise

import numpy as np
import pytest

from touchline.drawings import arc_columns, refit
from touchline.drawings.arc_columns import Complexes
from touchline.drawings.detail import Detail
from touchline.drawings.outline import Floats
from touchline.schemas.curves import Curve


def wave(count: int) -> list[Curve]:
    """A smooth curve drawn as many lines of about 0.1 m."""
    ends = [(0.1 * k, 0.5 * math.sin(0.1 * k)) for k in range(count + 1)]
    return [Curve.from_line(a, b) for a, b in pairwise(ends)]


def test_the_work_grows_as_the_chain_and_is_done_for_many_joints_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    looked: list[int] = []
    distances = arc_columns.distances

    def counted(points: Complexes, rows: Floats) -> Floats:
        found = distances(points, rows)
        looked.append(found.size)
        return found

    monkeypatch.setattr(refit, "distances", counted)
    work = []
    for count in (400, 800):
        looked.clear()
        drawn = wave(count)
        curves = refit.refit(drawn, [False] * count, False, Detail.of(0.12))
        assert len(curves) < count / 5
        assert sum(c.length_m for c in curves) == pytest.approx(sum(c.length_m for c in drawn), rel=1e-3)
        assert len(looked) < 2 * count, "one call looks from many joints"
        work.append(np.sum(looked) / count)
    assert work[1] == pytest.approx(work[0], rel=0.1), "per joint as much, however long the chain"
    assert work[1] < 4_000
