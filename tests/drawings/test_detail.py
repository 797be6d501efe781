"""Detail that a painted line cannot show gives way; everything else stays within the tolerance, both ways."""

import itertools
import math
from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.drawings.ten import HEAD, TEN
from touchline.drawings import importer
from touchline.drawings.comparison import draw_comparison
from touchline.drawings.detail import Detail
from touchline.drawings.importer import Imported, ImportOptions, import_drawing
from touchline.drawings.outline import Outline, bezier
from touchline.drawings.slivers import paintable
from touchline.drawings.strokes import StrokeKind, Strokes
from touchline.schemas.catalogue import parse_template
from touchline.schemas.curves import Curve
from touchline.schemas.errors import SpecError
from touchline.services.planner.tour import SEGMENTS_MAX

LINE_M = 0.12
DETAIL = Detail.of(LINE_M)
coordinates = st.floats(-6.0, 6.0, allow_nan=False).map(lambda value: round(value, 3))
points = st.tuples(coordinates, coordinates)
#: Points looked at are no farther apart, but on curves of more than a hundred of them.
FINE_M = 0.005
#: How many pieces, and how many corners among them, suffice for the drawings that have needless ones.
FEW = {
    "nearly straight arcs": (4, 3),
    "hundreds of curves": (60, 0),
    "slivers": (10, 1),
    "flattened curves": (40, 0),
    "holes and repeats": (20, 6),
    "tiny gaps": (16, 4),
}


def imported(tmp_path: Path, body: str, **options: object) -> Imported:
    path = tmp_path / "logo.svg"
    path.write_text(f"{HEAD}{body}</svg>")
    return import_drawing(path, ImportOptions(scale_m=0.5, **options))  # type: ignore[arg-type]


def strokes_of(found: Imported) -> list[Curve]:
    return [segment.curve() for segment in found.template.segments]


def sampled(curves: list[Curve]) -> list[np.ndarray]:
    """Fine polylines (n, 2): shapely then measures what the project's own code is not asked for."""
    counts = (min(max(math.ceil(curve.length_m / FINE_M), 8), 100) for curve in curves)
    return [np.column_stack(c.at(np.linspace(0.0, c.length_m, n))[:2]) for c, n in zip(curves, counts, strict=True)]


def apart_m(first: list[Curve], second: list[Curve]) -> float:
    """The Hausdorff distance by shapely, m."""
    one, other = sampled(first), sampled(second)
    return max(away_m(one, other), away_m(other, one))


def away_m(lines: list[np.ndarray], others: list[np.ndarray]) -> float:
    """Largest distance of a point of some polylines from the others, m."""
    pairs = np.concatenate([np.stack((line[:-1], line[1:]), axis=1) for line in others])
    points = shapely.points(np.concatenate(lines))
    found = shapely.STRtree(shapely.linestrings(pairs)).query_nearest(points, return_distance=True, all_matches=False)
    return float(found[1].max())


def corners(curves: list[Curve]) -> int:
    """Joints of connected curves that turn by more than a thousandth of a degree."""
    count = 0
    for a, b in itertools.pairwise(curves):
        joined = math.hypot(a.end[0] - b.x_m, a.end[1] - b.y_m) < 1e-6
        count += joined and abs(math.remainder(a.end[2] - b.heading_rad, 2 * math.pi)) > 1e-5
    return count


@pytest.mark.parametrize("name", list(TEN))
def test_ten_hard_drawings_stay_within_the_tolerance_with_few_pieces_and_meant_corners(
    tmp_path: Path, name: str
) -> None:
    found = imported(tmp_path, TEN[name])
    curves = strokes_of(found)
    assert parse_template(found.template.to_json()) == found.template
    assert all(paintable(curve) for curve in curves)
    assert found.deviation_m <= DETAIL.stray_m
    if not found.dots:
        assert apart_m(list(found.drawn), curves) == pytest.approx(found.deviation_m, abs=1e-3)
    most, most_corners = FEW.get(name, (len(curves), len(curves)))
    assert len(curves) <= most
    assert corners(curves) <= most_corners


def test_what_became_of_small_outlines_is_told(tmp_path: Path) -> None:
    dots = imported(tmp_path, TEN["dots"])
    assert (dots.dots, dots.skipped) == (2, ("circle-2",))
    assert all(curve.length_m >= LINE_M / 2 for curve in strokes_of(dots))
    assert imported(tmp_path, TEN["slivers"]).doubled == 2
    repeats = imported(tmp_path, TEN["holes and repeats"])
    assert (repeats.repeated, repeats.skipped) == (1, ("path-2",))


def test_large_lines_and_arcs_are_imported_bit_for_bit(tmp_path: Path) -> None:
    body = '<rect x="1" y="2" width="9" height="5"/><circle cx="15" cy="9" r="4"/><path d="M0 22h9a3 3 0 0 1 3-3l7 3"/>'
    exact, simplified = (imported(tmp_path, body, detail_m=detail) for detail in (0.0, None))
    assert simplified.template == exact.template
    assert simplified.deviation_m == 0.0


def test_a_small_detail_keeps_what_a_large_one_gives_up(tmp_path: Path) -> None:
    body = '<path d="M0 0H10V.06H10.2V0H20"/>'
    assert len(strokes_of(imported(tmp_path, body))) == 1
    kept = imported(tmp_path, body, detail_m=0.02)
    assert len(strokes_of(kept)) == 5
    assert kept.deviation_m < 1e-9


@pytest.mark.parametrize("turn", [(-1, 0, 0, 1), (0, 1, 1, 0)])
def test_a_mirrored_drawing_gives_the_mirrored_template(tmp_path: Path, turn: tuple[int, int, int, int]) -> None:
    a, b, c, d = turn
    placed = f'<g transform="matrix({a} {b} {c} {d} 0 0)">{TEN["letters"]}</g>'
    plain, mirrored = (imported(tmp_path, body) for body in (TEN["letters"], placed))
    assert len(plain.template.segments) == len(mirrored.template.segments)
    turned = [points @ [[a, -b], [-c, d]] for points in sampled(strokes_of(plain))]
    there, back = (sampled(strokes_of(mirrored)), turned), (turned, sampled(strokes_of(mirrored)))
    assert max(away_m(*there), away_m(*back)) < 1e-6


@given(st.lists(st.lists(points, min_size=3, max_size=3), min_size=1, max_size=5), points)
@settings(max_examples=6, deadline=None)
def test_any_chain_of_curves_stays_within_the_tolerance(
    spans: list[list[tuple[float, float]]], begin: tuple[float, float]
) -> None:
    ends = [begin, *(span[-1] for span in spans)]
    outline = Outline("chain", tuple(bezier([start, *span]) for start, span in zip(ends, spans, strict=False)))
    strokes = Strokes.of(outline, DETAIL)
    if strokes.kind is StrokeKind.LINES:
        assert apart_m(strokes.drawn, strokes.curves) <= DETAIL.stray_m + 1e-3
        assert all(paintable(curve) for curve in strokes.curves)
        assert all(math.dist(a.end[:2], (b.x_m, b.y_m)) < 1e-6 for a, b in itertools.pairwise(strokes.curves))


def test_curves_that_nobody_would_draw_are_no_work(tmp_path: Path) -> None:
    """Huge coordinates are refused before anything is fitted to them."""
    with pytest.raises(SpecError, match=r"reaches [0-9,]+ m from its centre origin; check --scale"):
        imported(tmp_path, '<path d="M0 0C1e7 0 -1e7 2e7 1e3 1e3C1e6 -1e6 2 3 4 5"/>')
    loops = "".join(f"C{8 + i} 8 {i} 8 {8 + i} 0" for i in range(12))
    assert imported(tmp_path, f'<path d="M0 0{loops}"/>').deviation_m <= DETAIL.stray_m


def test_more_than_can_be_planned_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert importer.MAX_SEGMENTS == SEGMENTS_MAX
    monkeypatch.setattr(importer, "MAX_SEGMENTS", 1000)
    zigzag = "".join(f"L{k % 100} {k % 97 + k % 2}" for k in range(1002))
    with pytest.raises(SpecError, match=r"strokes, more than the 1,000 that can be planned; simplify .* --detail"):
        imported(tmp_path, f'<path fill="none" stroke="red" d="M0 9{zigzag}"/>')


def test_the_work_is_told_as_it_goes_on(tmp_path: Path) -> None:
    path, told = tmp_path / "logo.svg", []
    path.write_text(f"{HEAD}{TEN['dots']}</svg>")
    import_drawing(path, ImportOptions(scale_m=0.5), lambda fraction, doing: told.append((fraction, doing)))
    assert told[0] == (0.0, "reading") and told[-1][1].startswith("fitting")
    assert [fraction for fraction, _ in told] == sorted(fraction for fraction, _ in told)


@pytest.mark.parametrize("ending", ["svg", "png"])
def test_the_picture_shows_where_drawing_and_template_differ_most(tmp_path: Path, ending: str) -> None:
    found = imported(tmp_path, TEN["dots"] + '<path d="M1 12C9 9 9 20 20 14"/>')
    path = tmp_path / f"picture.{ending}"
    draw_comparison(found, path)
    content = path.read_bytes()
    assert content.startswith(b"\x89PNG" if ending == "png" else b"<?xml")
    assert len(content) > 5_000
