"""The picture of a plan."""

import json
from pathlib import Path

import pytest

from touchline.schemas.catalogue import load_template, parse_template
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.plan import plan
from touchline.services.planner.plots.plan_picture import plot_plan


def test_svg_and_png(tmp_path: Path) -> None:
    template = load_template("study-square")
    planned = plan(template, Vehicle())
    for name in ("a.svg", "b.svg", "c.png"):
        plot_plan(planned, template, tmp_path / name)
    svg = (tmp_path / "a.svg").read_text()
    assert svg.startswith("<?xml")
    assert svg == (tmp_path / "b.svg").read_text()
    assert (tmp_path / "c.png").read_bytes().startswith(b"\x89PNG")


def test_an_unknown_format_is_refused(tmp_path: Path) -> None:
    template = load_template("study-square")
    with pytest.raises(ValueError, match="not supported"):
        plot_plan(plan(template, Vehicle()), template, tmp_path / "a.xyz")


@pytest.mark.parametrize("colour", ["plain", "speed"])
def test_obstacles_are_drawn_where_they_leave_all_lines_clear(tmp_path: Path, colour: str) -> None:
    segments = [{"id": n, "line": {"start": [0, y], "end": [5, y]}} for n, y in (("a", 0), ("b", 6))]
    bench = {"id": "bench", "corners": [[2, 2.5], [3, 2.5], [3, 3.5], [2, 3.5]]}
    template = parse_template(json.dumps({"name": "two", "segments": segments, "obstacles": [bench]}))
    plot_plan(plan(template, Vehicle()), template, path := tmp_path / "p.svg", colour)
    assert 'id="obstacles"' in path.read_text()


def test_one_transition_is_one(tmp_path: Path) -> None:
    segments = [{"id": n, "line": {"start": [0, y], "end": [5, y]}} for n, y in (("a", 0), ("b", 3))]
    template = parse_template(json.dumps({"name": "two", "segments": segments}))
    plot_plan(plan(template, Vehicle()), template, path := tmp_path / "p.svg")
    assert "2 lines 10.0 m  ·  1 transition " in path.read_text()
