"""Overlays that never fail, and change nothing where the exact one works."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import shapely

from touchline.core import robust_overlay

BOW = shapely.Polygon([(0.0, 0.0), (2.0, 2.0), (2.0, 0.0), (0.0, 2.0)])
"""Crosses itself: the library refuses overlays of it."""
BOX = shapely.box(0.0, 0.0, 2.0, 2.0)


@pytest.mark.parametrize(
    ("ours", "exact"),
    [
        (robust_overlay.intersection, shapely.intersection),
        (robust_overlay.difference, shapely.difference),
        (robust_overlay.symmetric_difference, shapely.symmetric_difference),
        (robust_overlay.union_of_two, shapely.union),
        (lambda a, b: robust_overlay.union([a, b]), lambda a, b: shapely.union_all([a, b])),
        (lambda a, b: robust_overlay.intersections(a, np.array([b]))[0], shapely.intersection),
        (lambda a, b: robust_overlay.differences(np.array([a]), b)[0], shapely.difference),
        (lambda a, _: robust_overlay.buffer(a, 0.3), lambda a, _: a.buffer(0.3)),
    ],
)
def test_what_works_exactly_is_the_same_to_the_bit(ours: Callable[..., Any], exact: Callable[..., Any]) -> None:
    rng = np.random.default_rng(5)
    for _ in range(20):
        a, b = (shapely.Polygon(rng.uniform(0.0, 5.0, (3, 2))) for _ in range(2))
        assert ours(a, b).wkb == exact(a, b).wkb


def test_shapes_that_the_library_refuses_have_an_overlay() -> None:
    with pytest.raises(shapely.errors.GEOSException):
        shapely.difference(BOX, BOW)
    assert robust_overlay.difference(BOX, BOW).area == pytest.approx(2.0)
    assert robust_overlay.intersection(BOX, BOW).area == pytest.approx(2.0)
    assert [each.area for each in robust_overlay.intersections(BOX, np.array([BOX, BOW]))] == pytest.approx([4.0, 2.0])


@pytest.mark.parametrize("fails", [1, 4])
def test_the_finest_grid_that_works_is_taken(monkeypatch: pytest.MonkeyPatch, fails: int) -> None:
    asked: list[float | None] = []
    exact = shapely.union_all

    def moody(shapes: Any, grid_size: float | None = None) -> Any:
        asked.append(grid_size)
        if len(asked) <= fails:
            raise shapely.errors.GEOSException("TopologyException: side location conflict")
        return exact(shapes, grid_size=grid_size)

    monkeypatch.setattr(shapely, "union_all", moody)
    assert robust_overlay.union([BOX, shapely.box(1.0, 0.0, 3.0, 2.0)]).area == pytest.approx(6.0)
    assert asked == [None, *robust_overlay.GRIDS_M[:fails]]
