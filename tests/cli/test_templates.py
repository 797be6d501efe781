"""``touchline templates`` and the options that say what is painted where."""

import json
from pathlib import Path

import pytest

from touchline.schemas.catalogue import load_template, parse_template


def test_parameters_and_placement_reach_the_template(touchline, tmp_path: Path) -> None:
    out, plot = tmp_path / "pitch.json", tmp_path / "pitch.svg"
    options = ["--set", "length=100", "--set", "width=64", "--place", "10,20,90,mirror", "--origin", "57.1,9.9,12"]
    code, _, err = touchline("templates", "soccer-11", *options, "--out", str(out), "--plot", str(plot))
    assert code == 0, err
    template = load_template(out)
    assert template.title == "Soccer, 11-a-side, 100 x 64 m"
    assert template.origin is not None and template.origin.latitude_deg == 57.1
    xs = [segment.curve().x_m for segment in template.segments]
    assert max(xs) - min(xs) == pytest.approx(64.0, abs=0.2)
    assert "<svg" in plot.read_text()
    _, planned, _ = touchline("plan", "soccer-11", "--set", "length=100", "--set", "width=64", "--json")
    assert json.loads(planned)["length_m"]["paint"] == pytest.approx(template.length_m, rel=0.01)
    _, carried, _ = touchline("templates", str(out), "--map-origin", "57.1,9.901,12")
    moved = parse_template(carried).segments[0].curve()
    assert moved.x_m - template.segments[0].curve().x_m == pytest.approx(-60.6, abs=0.5)


def test_templates_are_listed_with_their_parameters_and_printed(touchline) -> None:
    listed = touchline("templates")[1]
    assert "soccer-11" in listed and "study-square" in listed
    rows = {row["name"]: row for row in json.loads(touchline("templates", "--json")[1])}
    assert rows["study-square"]["length_m"] == pytest.approx(4.0)
    assert rows["soccer-11"]["parameters"][0] == {
        "name": "length",
        "default": 105.0,
        "allowed": "90 to 120",
        "description": "touchlines, outside to outside, m",
    }
    printed = touchline("templates", "soccer-11")[1]
    assert len(parse_template(printed).segments) == rows["soccer-11"]["segments"]


def test_text_and_drawings_become_templates(touchline, tmp_path: Path) -> None:
    _, written, _ = touchline("templates", "text", "GO TEAM", "--height", "2")
    assert parse_template(written).title == "GO TEAM"
    _, rounded, err = touchline("templates", "text", "GO", "--height", "1", "--corners", "round")
    assert err == ""
    assert any(segment.arc for segment in parse_template(rounded).segments)
    drawing, out = tmp_path / "logo.svg", tmp_path / "logo.json"
    drawing.write_text('<svg><path d="M0 0C5 0 5 5 9 5" fill="none" stroke="black"/><text>GO</text></svg>')
    plot, options = tmp_path / "logo.png", ["--scale", "2"]
    code, _, err = touchline("templates", "import", str(drawing), *options, "--out", str(out), "--plot", str(plot))
    assert code == 0, err
    assert "text (line 1) is a text; convert it to paths" in err and "of 1 drawn ones" in err
    assert plot.read_bytes().startswith(b"\x89PNG")
    _, _, finer = touchline("templates", "import", str(drawing), *options, "--detail", "0")
    assert "within 0." in finer
    planned = json.loads(touchline("plan", str(out), "--json")[1])
    assert planned["segments"]["painted"] == len(load_template(out).segments)


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("templates", "soccer-11", "--set", "length=300"), "give 90 to 120"),
        (("templates", "soccer-11", "--set", "length"), "--set is 'length'; give name=value"),
        (("templates", "--set", "length=100"), "--set is given without a template"),
        (("plan", "soccer-11", "--place", "1"), "--place is '1'; give x,y"),
        (("plan", "soccer-11", "--origin", "91,0"), "latitude_deg is 91; give at most 89 degrees"),
        (("run", "soccer-11", "--set", "size=1"), "size is not a parameter"),
        (("templates", "soccer-11", "--map-origin", "57,9"), "give its origin with --origin"),
        (("templates", "soccer-11", "--plot", "x.png"), "use .svg"),
        (("templates", "text", "Ø"), "has no glyph for Ø"),
        (("templates", "import", "/no/such.svg"), "is not a file"),
    ],
)
def test_what_cannot_be_meant_is_told_in_one_line(
    touchline, monkeypatch, arguments: tuple[str, ...], says: str
) -> None:
    monkeypatch.setenv("COLUMNS", "120")
    code, _, err = touchline(*arguments)
    assert code == 2
    assert says in err
    assert "Traceback" not in err


def test_closed_shapes_become_areas(touchline, tmp_path: Path) -> None:
    path, out, plot = tmp_path / "pan.svg", tmp_path / "pan.json", tmp_path / "pan.png"
    path.write_text(
        '<svg viewBox="0 0 40 20"><path d="M0 0H20V10H0ZM5 2V8H15V2Z"/><path d="M30 0L34 4V0L30 4Z"/></svg>'
    )
    arguments = ["import", str(path), "--scale", "1", "--areas", "--out", str(out), "--plot", str(plot)]
    code, _, err = touchline("templates", *arguments)
    assert code == 0, err
    assert "3 areas of 148.00 m² with 1 hole" in err
    assert "crosses itself; the enclosed parts are the area: path-2" in err
    assert load_template(out).area_m2 == pytest.approx(148.0)
    assert plot.stat().st_size > 5_000
