"""SVG as a browser shows it: where things are, what is visible, what is cut, and what is left out by name."""

from pathlib import Path

import numpy as np
import pytest

from touchline.drawings.deviation import sampled
from touchline.drawings.importer import Anchor, Imported, ImportOptions, import_drawing
from touchline.schemas.errors import SpecError

OWN = ImportOptions(anchor=Anchor.OWN, detail_m=0.0)
#: A page of 40 x 20 m whose user units are metres.
PAGE = 'width="40000mm" height="20000mm" viewBox="0 0 40 20"'
LINE = '<path id="l" d="M5 5h10" stroke="black"/>'


def shown(tmp_path: Path, body: str, head: str = PAGE) -> Imported:
    path = tmp_path / "page.svg"
    spaces = 'xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink"'
    path.write_text(f"<svg {spaces} {head}>{body}</svg>")
    return import_drawing(path, OWN)


def box_of(imported: Imported) -> tuple[float, ...]:
    """Lowest and highest x and y, m; y is down again, as in the drawing."""
    points = np.concatenate([sampled(segment.curve(), 65) for segment in imported.template.segments])
    (x1, y1), (x2, y2) = points.min(axis=0), points.max(axis=0)
    return (x1, -y2, x2, -y1)


def lengths(imported: Imported) -> list[float]:
    return [segment.curve().length_m for segment in imported.template.segments]


SQUARE = '<rect x="10" y="10" width="80" height="80" fill="none" stroke="black"/>'
TALL = 'width="40000mm" height="20000mm" viewBox="0 0 100 100"'


@pytest.mark.parametrize(
    ("aspect", "size"),
    [
        ("", (16.0, 16.0)),
        ("xMidYMid meet", (16.0, 16.0)),
        ("none", (32.0, 16.0)),
        ("nonsense", (16.0, 16.0)),
    ],
)
def test_the_page_keeps_its_aspect_ratio(tmp_path: Path, aspect: str, size: tuple[float, float]) -> None:
    x1, y1, x2, y2 = box_of(shown(tmp_path, SQUARE, f'{TALL} preserveAspectRatio="{aspect}"'))
    assert (x2 - x1, y2 - y1) == pytest.approx(size)


@pytest.mark.parametrize(
    ("aspect", "box"),
    [
        ("xMinYMin", (5, 5, 15, 15)),
        ("xMidYMid", (10, 5, 20, 15)),
        ("xMaxYMax", (15, 5, 25, 15)),
        ("none", (5, 5, 25, 15)),
        ("xMidYMin slice", (5, 5, 25, 15)),  # 20 x 20 of which the upper 10 show
    ],
)
def test_a_nested_svg_is_a_viewport(tmp_path: Path, aspect: str, box: tuple[float, ...]) -> None:
    inner = f'<svg x="5" y="5" width="20" height="10" viewBox="0 0 1 1" preserveAspectRatio="{aspect}">'
    body = f'{inner}<path fill="none" stroke="red" d="M0 0H1V1H0Z"/></svg>'
    assert box_of(shown(tmp_path, body)) == pytest.approx(box, abs=0.02)


@pytest.mark.parametrize(
    ("use", "box"),
    [
        ('x="5" y="5"', (5, 5, 40, 20)),
        ('x="5" y="5" width="20" height="10"', (5, 5, 25, 15)),
        ('x="5" y="5" width="50%" height="50%" transform="translate(1 1)"', (6, 6, 26, 16)),
    ],
)
def test_a_symbol_is_as_large_as_its_use_says(tmp_path: Path, use: str, box: tuple[float, ...]) -> None:
    symbol = '<symbol id="s" viewBox="0 0 2 1" preserveAspectRatio="none"><rect width="2" height="1"/></symbol>'
    assert box_of(shown(tmp_path, f'{symbol}<use xlink:href="#s" {use}/>')) == pytest.approx(box, abs=0.02)


HIDDEN = 'd="M5 9h10" stroke="black" fill="none"'


@pytest.mark.parametrize(
    "body",
    [
        f'<g visibility="hidden"><path {HIDDEN}/></g>',
        f'<path {HIDDEN} style="visibility:hidden"/>',
        f'<path {HIDDEN} style="visibility:collapse"/>',
        f'<g display="none"><path {HIDDEN}/></g>',
        f'<g opacity="0"><path {HIDDEN}/></g>',
        f'<path {HIDDEN} stroke-opacity="0%"/>',
        f'<path {HIDDEN} style="stroke:none"/>',
        f'<path {HIDDEN} style="stroke:rgb(0 0 0 / 0)"/>',
        f'<path {HIDDEN} stroke-width="0"/>',
        f'<path {HIDDEN} transform="scale(0)"/>',
        f'<path {HIDDEN} class="a b"/><style>.x, .b {{ stroke: none !important }}</style>',
        f'<style>g > path:not(.shown)[d] {{ display: none }}</style><g><path {HIDDEN}/></g>',
        f'<style>@media screen {{ #h {{ stroke: none }} }}</style><path id="h" {HIDDEN}/>',
        f'<style>@media print {{ #l {{ stroke: none }} }}</style><path {HIDDEN} opacity="0"/>',
        f'<style>path ~ path {{ --s: none }}</style><path {HIDDEN} style="stroke: var(--s, red)"/>',
        f'<mask id="m"><rect width="30" height="15"/></mask><marker id="k"><path {HIDDEN}/></marker>',
        f'<clipPath id="c"><path {HIDDEN}/></clipPath><pattern id="p"><path {HIDDEN}/></pattern>',
        f'<symbol id="s"><path {HIDDEN}/></symbol><defs><path {HIDDEN}/></defs>',
        f'<unknown><path {HIDDEN}/></unknown><metadata><path {HIDDEN}/></metadata>',
        f'<svg width="0" height="5"><path {HIDDEN}/></svg><svg viewBox="0 0 0 5"><path {HIDDEN}/></svg>',
        f'<switch><g systemLanguage="xx"><path {HIDDEN}/></g><g/><path {HIDDEN}/></switch>',
        f'<g requiredExtensions="http://example.org"><path {HIDDEN}/></g>',
        '<rect width="5" height="0" stroke="red"/><circle r="0" stroke="red"/><ellipse rx="3" ry="0" stroke="red"/>',
        '<polygon points="3 4" stroke="red"/><polyline points="" stroke="red"/><path d="" stroke="red"/>',
        f'<linearGradient id="g"/><path {HIDDEN} style="stroke:url(#g)"/>',
        f'<linearGradient id="g"><stop/></linearGradient><path {HIDDEN} style="stroke:url(#g)"/>',  # has no height
        f'<path {HIDDEN} style="stroke:url(#l)"/>',
    ],
)  # fmt: skip
def test_what_is_not_visible_is_not_painted(tmp_path: Path, body: str) -> None:
    imported = shown(tmp_path, LINE + body)
    assert lengths(imported) == pytest.approx([10.0])
    assert imported.omissions == () and imported.skipped == ()


@pytest.mark.parametrize(
    "body",
    [
        '<g visibility="hidden"><path visibility="visible" {0}/></g>',
        '<g color="red"><path {0} style="stroke:currentColor"/></g>',
        '<g stroke="red"><path {0} style="stroke:inherit"/></g>',
        '<path {0} style="stroke:nonsense"/>',
        '<path {0} stroke-opacity="inherit" style="fill:url(#none)"/>',
        '<path {0} style="stroke:url(#none) green"/>',
        '<switch><g systemLanguage="xx"/><g systemLanguage="fr, en-GB"><path {0}/></g></switch>',
        '<defs><path id="h" {0}/></defs><use href="#h" style="visibility:visible"/>',
        '<a href="#x"><path {0}/></a>',
        '<path {0} mask="url(#none)" clip-path="url(#none)" filter="url(#none)"/>',
        '<path {0} class="late"/><style><![CDATA[.late{{fill:none}}]]></style>',
        '<path {0} style="vector-effect:non-scaling-stroke"/>',
    ],
)
def test_what_is_visible_is_painted(tmp_path: Path, body: str) -> None:
    imported = shown(tmp_path, LINE + body.format(HIDDEN))
    assert lengths(imported) == pytest.approx([10.0, 10.0])
    assert imported.omissions == ()


@pytest.mark.parametrize(
    ("element", "reason"),
    [
        ('<text id="x">GO</text>', "is a text; convert it to paths"),
        ('<image id="x" href="x.png" width="3" height="3"/>', "is an image; trace it"),
        ('<foreignObject id="x" width="3" height="3"/>', "holds something that is no SVG"),
        (f'<mask id="m"/><path id="x" {HIDDEN} mask="url(#m)"/>', "has a mask"),
        (f'<filter id="f"/><g id="x" filter="url(#f)"><path {HIDDEN}/></g>', "has a filter"),
        (f'<path id="x" {HIDDEN} style="filter:blur(2px)"/>', "has a filter"),
        (f'<path id="x" {HIDDEN} style="clip-path:circle(2px)"/>', "is clipped by what is no clipPath"),
        (f'<clipPath id="c"><text>GO</text></clipPath><path id="x" {HIDDEN} clip-path="url(#c)"/>', "by a text"),
        ('<use id="x" href="other.svg#a"/>', "refers to another file"),
        ('<use id="x" href="#nothing"/>', "refers to '#nothing', which is not there"),
        ('<g id="g"><use id="x" href="#g"/></g>', "refers to what it is in"),
        ('<path id="x" d="M1 1h9" fill="red"/>', "has no stroke, and its fill encloses nothing"),
        ('<line id="x" x1="1" y1="1" x2="9" y2="9"/>', "has no stroke, and its fill encloses nothing"),
        ('<circle id="x" r="-1"/>', "its radius is negative"),
        ('<rect id="x" width="-1" height="3"/>', "its width or height is negative"),
        ('<rect id="x" width="9" height="3" style="width:calc(3px + 2px)"/>', "its width is calculated"),
        ('<path id="x" stroke="red" d="L5 5"/>', "its path data has an error after character 0"),
        (f'<path id="x" {HIDDEN} style="translate:3px"/>', "is moved by a CSS property"),
        ('<path id="x" stroke="red" d="M1 1L1e400 1"/>', "is not finite"),
    ],
)
def test_what_cannot_be_painted_is_left_out_by_name(tmp_path: Path, element: str, reason: str) -> None:
    imported = shown(tmp_path, f"{LINE}\n{element}")
    assert lengths(imported) == pytest.approx([10.0])
    assert any(reason in omission.reason and omission.line == 2 for omission in imported.omissions)
    assert all(omission.element == "x (line 2)" for omission in imported.omissions)


@pytest.mark.parametrize(
    ("element", "reason", "length"),
    [
        (f'<marker id="k"/><path id="x" {HIDDEN} marker-end="url(#k)"/>', "has markers", 10.0),
        (f'<path id="x" {HIDDEN}><animate attributeName="d"/></path>', "is animated", 10.0),
        ('<path id="x" stroke="red" d="M5 9h10L12"/>', "has an error after character 7", 10.0),
        ('<polyline id="x" fill="none" stroke="red" points="5,9 15,9 3"/>', "points have an error", 10.0),
        ('<path id="x" stroke="red" d="M30 9h20"/>', "reaches beyond the page", 10.0),
        (
            '<pattern id="p" width="1" height="1"><path/></pattern><rect id="x" width="2" height="1" fill="url(#p)"/>',
            "has a pattern", 6.0,
        ),
    ],
)  # fmt: skip
def test_what_cannot_be_painted_of_a_line_is_named(tmp_path: Path, element: str, reason: str, length: float) -> None:
    imported = shown(tmp_path, LINE + element)
    assert sum(lengths(imported)) == pytest.approx(10.0 + length, abs=0.03)
    (omission,) = imported.omissions
    assert omission.name == "x" and reason in omission.reason


@pytest.mark.parametrize(
    ("d", "length"),
    [
        ("M20 5h4A2 2 0 0 1 24 5h4", 8.0),  # ends where it begins: nothing
        ("M20 5h4a0 3 0 0 1 4 0", 8.0),  # no radius: a straight line
        ("M20 5h4a0 0 0 0 1 0 0h4", 8.0),
        ("M20 5a1 1 0 0 1 4 0", 2 * np.pi),  # radii too small: a half circle
        ("M20 5a-2-2 0 014 0", 2 * np.pi),  # flags without spaces, negative radii
        ("M20 5M21 6h4", 4.0),
        ("m20 5 4 0", 4.0),
        ("M20 5h4zh2", 10.0),
        ("M20 5h4zz", 8.0),
        ("M20,5,h4", 0.0),
        ("M20 5.5.5.5", np.hypot(19.5, 5.0)),
        ("M 20 5 q 2 0 4 0 t 4 0", 8.0),
        ("M20 5c0 0 4 0 4 0s4 0 4 0", 8.0),
    ],
)
def test_path_data_of_every_kind(tmp_path: Path, d: str, length: float) -> None:
    imported = shown(tmp_path, f'{LINE}<path fill="none" stroke="black" d="{d}"/>')
    assert sum(lengths(imported)) == pytest.approx(10.0 + length, abs=2e-3)


@pytest.mark.parametrize(
    ("transform", "box"),
    [
        ('transform="rotate(90 10 10)"', (8, 5, 10, 15)),
        ('transform="translate(5,5)scale(2)"', (15, 25, 35, 29)),
        ('style="transform: translate(5px, 10%) scale(.5)"', (7.5, 7, 12.5, 8)),
        ('style="transform: rotate(0.5turn); transform-origin: center"', (25, 8, 35, 10)),
        ('style="transform: rotate(180deg); transform-box: fill-box; transform-origin: 50% 50%"', (5, 10, 15, 12)),
        ('style="transform: rotate(90)"', (5, 10, 15, 12)),  # without a unit it is not valid
        ('transform="rotate(90) nonsense(1)"', (5, 10, 15, 12)),
        ('transform="matrix(1 0 0 1 0 0.5)" style="transform: none"', (5, 10, 15, 12)),
    ],
)
def test_transforms_of_every_kind(tmp_path: Path, transform: str, box: tuple[float, ...]) -> None:
    body = f'<rect x="5" y="10" width="10" height="2" {transform}/>'
    head = (
        'width="80000mm" height="80000mm" viewBox="-20 -20 80 80"'
        if "%" not in transform and "center" not in transform
        else PAGE
    )
    assert box_of(shown(tmp_path, body, head)) == pytest.approx(box, abs=0.02)


@pytest.mark.parametrize(
    ("clip", "body", "box"),
    [
        ("", '<path d="M0 10h40" stroke="red"/>', (10, 10, 20, 10)),
        ("", '<circle cx="15" cy="10" r="2" fill="none" stroke="red"/>', (13, 8, 17, 12)),
        ("", '<rect width="40" height="10"/>', (10, 5, 20, 10)),
        ('clipPathUnits="objectBoundingBox" transform="scale(.05)"', '<rect width="40" height="20"/>', (20, 5, 40, 15)),
        ('transform="translate(5 0)"', '<path d="M0 10h40" stroke="red"/>', (15, 10, 25, 10)),
    ],
)
def test_what_is_clipped_is_cut(tmp_path: Path, clip: str, body: str, box: tuple[float, ...]) -> None:
    cut = f'<clipPath id="c" {clip}><rect x="10" y="5" width="10" height="10"/></clipPath>'
    imported = shown(tmp_path, f'{cut}<g clip-path="url(#c)">{body}</g>')
    assert box_of(imported) == pytest.approx(box, abs=0.03)
    assert imported.omissions == ()


def test_dashes_are_painted_one_by_one(tmp_path: Path) -> None:
    body = '<g transform="scale(2)"><path d="M1 1h9" stroke="red" stroke-dasharray="2 1" stroke-dashoffset="1"/></g>'
    assert lengths(shown(tmp_path, body)) == pytest.approx([2.0, 4.0, 4.0, 2.0])
    thin = '<path id="x" d="M1 1h30" stroke="red" stroke-dasharray="1e-9"/>'
    with pytest.raises(SpecError, match=r"x \(line 1\) has more than 5,000 dashes"):
        shown(tmp_path, thin)


def test_a_page_without_a_size_has_no_shares(tmp_path: Path) -> None:
    path = tmp_path / "page.svg"
    path.write_text(f'<svg>{LINE}<rect id="x" width="50%" height="3"/><svg id="y"><path {HIDDEN}/></svg></svg>')
    imported = import_drawing(path, ImportOptions(scale_m=1.0, anchor=Anchor.OWN))
    assert lengths(imported) == pytest.approx([10.0])
    assert [omission.name for omission in imported.omissions] == ["x", "y"]


@pytest.mark.parametrize(
    "element",
    [
        '<path stroke="red" d="M0 0A1e-320 1e-320 0 0 0 1 1"/>',
        '<path stroke="red" d="M0 0A1e308 1e308 0 0 0 1 1"/>',
        '<path stroke="red" d="M0 0A1 1e-300 0 0 0 1 1"/>',
        '<circle r="1e200"/>',
        '<rect width="1e-300" height="1e300"/>',
        '<path d="M0 0C1e200 0 0 1e200 1 1" stroke="red" fill="none"/>',
        '<clipPath id="c"><circle r="1e300"/></clipPath><path clip-path="url(#c)" d="M0 0L5 9 9 0Z"/>',
        '<svg viewBox="0 0 1e-300 1e-300"><rect width="1" height="1"/></svg>',
    ],
)
def test_numbers_of_any_size_leave_the_rest_alone(tmp_path: Path, element: str) -> None:
    imported = shown(tmp_path, LINE + element)
    assert lengths(imported) == pytest.approx([10.0])
    assert imported.omissions
