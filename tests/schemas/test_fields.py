"""The fields against their governing bodies' dimensions, worked out here from the rules' own figures."""

import itertools
import math
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from shapely import LineString, Point
from shapely.geometry.base import BaseGeometry

from touchline.schemas.catalogue import line_templates, load_template, parse_template, shipped_templates
from touchline.schemas.errors import SpecError
from touchline.schemas.fields import FIELDS
from touchline.schemas.fields.athletics import AthleticsTrack, run_radius_m, stagger_m, straight_m
from touchline.schemas.template import Template, TemplateSegment

INCH, FOOT, YARD = 0.0254, 0.3048, 0.9144
WEST, SOUTH, EAST, NORTH = range(4)


@cache
def field(name: str) -> Template:
    return load_template(name)


def stroke(template: Template, name: str) -> TemplateSegment:
    return next(segment for segment in template.segments if segment.id == name)


def paint(template: Template, name: str) -> BaseGeometry:
    """The ground that a stroke covers: as wide as the line, with square ends."""
    curve = stroke(template, name).curve()
    x, y, _, _ = curve.at(np.linspace(0.0, curve.length_m, 2 if curve.curvature_1pm == 0 else 4001))
    return LineString(np.column_stack((x, y))).buffer(template.line_width_m / 2, cap_style="flat")


# (template, stroke, edge of its paint, where the rules put that edge, m)
DIMENSIONS = [
    # FA guide: 80 x 50 yards, penalty area 13 by 32 yards, mark 9 yards, circle 7 yards
    ("soccer-9", "goal-line-east", EAST, 40 * YARD),
    ("soccer-9", "touchline-north", NORTH, 25 * YARD),
    ("soccer-9", "penalty-area-west-front", EAST, (-40 + 13) * YARD),
    ("soccer-9", "penalty-area-west-front", NORTH, 16 * YARD),
    ("soccer-9", "goal-area-west-front", EAST, (-40 + 4) * YARD),
    ("soccer-9", "penalty-arc-west", EAST, (-40 + 9 + 7) * YARD),
    ("soccer-9", "penalty-mark-west", EAST, (-40 + 9) * YARD + 0.12),
    ("soccer-9", "centre-circle", EAST, 7 * YARD),
    # FA guide: 60 x 40 yards, penalty area 10 by 18 yards, mark 8 yards, circle 6 yards
    ("soccer-7", "goal-line-west", WEST, -30 * YARD),
    ("soccer-7", "touchline-south", SOUTH, -20 * YARD),
    ("soccer-7", "penalty-area-east-front", WEST, (30 - 10) * YARD),
    ("soccer-7", "penalty-area-east-front", SOUTH, -9 * YARD),
    ("soccer-7", "penalty-mark-east", EAST, (30 - 8) * YARD + 0.12),
    ("soccer-7", "centre-circle", NORTH, 6 * YARD),
    # NCAA 1-2-1: inside edges 360 by 160 feet; goal lines in the end zones; hash marks 60 feet from the sidelines
    ("american-football", "sideline-north", SOUTH, 80 * FOOT),
    ("american-football", "end-line-west", EAST, -180 * FOOT),
    ("american-football", "goal-line-east", WEST, 150 * FOOT),
    ("american-football", "goal-line-east", EAST, 150 * FOOT + 4 * INCH),
    ("american-football", "hash-north-west-49", SOUTH, 20 * FOOT),
    ("american-football", "hash-north-west-49", NORTH, 22 * FOOT),
    ("american-football", "hash-south-east-1", NORTH, -20 * FOOT),
    ("american-football", "sideline-south-east-1", SOUTH, -80 * FOOT + 4 * INCH),
    ("american-football", "yard-line-west-20", NORTH, 80 * FOOT - 4 * INCH),
    ("american-football", "yard-line-west-20", WEST, -90 * FOOT - 2 * INCH),
    # the digits' tops 9 yards from the sideline, 6 feet high
    ("american-football", "number-south-west-20-ones-1", NORTH, -80 * FOOT + 9 * YARD),
    ("american-football", "number-north-west-20-ones-1", SOUTH, 80 * FOOT - 9 * YARD),
    # World Rugby Law 1: 100 by 70 m inside touch and goal lines, 22 including its line
    ("rugby-union", "touchline-north", SOUTH, 35.0),
    ("rugby-union", "goal-line-west", EAST, -50.0),
    ("rugby-union", "22-metre-line-west", EAST, -28.0),
    ("rugby-union", "dead-ball-line-east", WEST, 60.0),
    ("rugby-union", "5-metre-line-south-4", WEST, -2.5),
    ("rugby-union", "15-metre-line-north-1", SOUTH, 35 - 15 - 0.05),
    ("rugby-union", "10-metre-line-west-4", SOUTH, -2.5),
    ("rugby-union", "10-metre-line-west-4", EAST, -10 + 0.05),
    # NCAA men's lacrosse: 110 x 60 yards, restraining lines 20 yards from the centre, goals 15 from the end lines
    ("lacrosse", "end-line-west", WEST, -55 * YARD),
    ("lacrosse", "sideline-south", SOUTH, -30 * YARD),
    ("lacrosse", "restraining-line-west", WEST, -20 * YARD - 2 * INCH),
    ("lacrosse", "goal-line-west", EAST, -40 * YARD + 2 * INCH),
    ("lacrosse", "crease-east", EAST, 40 * YARD + 9 * FOOT),
    ("lacrosse", "wing-line-north", EAST, 10 * YARD),
    ("lacrosse", "wing-line-north", NORTH, 20 * YARD + 2 * INCH),
    ("lacrosse", "goal-area-west-north", NORTH, 20 * YARD + 2 * INCH),
    # FIH: 91.40 x 55.00 m over all, circle 14.63 m, 23-metre lines 22.90 m, broken line 5 m further out
    ("field-hockey", "back-line-west", WEST, -45.70),
    ("field-hockey", "side-line-north", NORTH, 27.50),
    ("field-hockey", "23-metre-line-west", EAST, -45.70 + 22.90),
    ("field-hockey", "circle-west-top", EAST, -45.70 + 14.63),
    ("field-hockey", "circle-west-top", NORTH, 1.83),
    ("field-hockey", "circle-west-north", NORTH, 1.83 + 14.63),
    ("field-hockey", "broken-line-west-10", EAST, -45.70 + 19.63),
    ("field-hockey", "broken-line-west-10", NORTH, 0.15),
    ("field-hockey", "penalty-spot-west-1", SOUTH, -0.075),
    ("field-hockey", "side-mark-west-14-63-north", NORTH, 27.80),
    ("field-hockey", "side-mark-west-14-63-north", EAST, -45.70 + 14.63),
    ("field-hockey", "back-mark-west-5-north", NORTH, 1.83 + 0.05 + 5),
    # ITF Rule 1: 23.77 by 10.97 (8.23) m, service lines 6.40 m
    ("tennis", "baseline-east", EAST, 23.77 / 2),
    ("tennis", "doubles-sideline-north", NORTH, 10.97 / 2),
    ("tennis", "singles-sideline-south", SOUTH, -8.23 / 2),
    ("tennis", "service-line-west", WEST, -6.40),
    ("tennis", "centre-service-line", NORTH, 0.025),
    # FIBA Article 2: 28 x 15 m inside, free-throw line's further edge 5.80 m, 3-point line 0.90 m and 6.75 m
    ("basketball", "end-line-west", EAST, -14.0),
    ("basketball", "sideline-south", NORTH, -7.5),
    ("basketball", "free-throw-line-west", EAST, -14 + 5.80),
    ("basketball", "free-throw-line-west", NORTH, 2.45),
    ("basketball", "free-throw-line-west", SOUTH, -2.45),
    ("basketball", "three-point-west-north", NORTH, 7.5 - 0.90),
    ("basketball", "three-point-west-arc", EAST, -14 + 1.575 + 6.75),
    ("basketball", "no-charge-east-arc", WEST, 14 - 1.575 - 1.25 - 0.05),
    ("basketball", "centre-circle", WEST, -1.80),
    # rebound places 0.85 m apart from the first at 1.75 m, with a block of 0.40 m between
    ("basketball", "rebound-place-west-north-1", WEST, -14 + 1.75),
    ("basketball", "neutral-zone-west-north-1", WEST, -14 + 1.75 + 0.05 + 0.85),
    ("basketball", "rebound-place-west-north-2", WEST, -14 + 1.75 + 0.05 + 0.85 + 0.40 + 0.85),
    ("basketball", "rebound-place-west-north-3", WEST, -14 + 1.75 + 0.05 + 0.85 + 0.40 + 0.85 + 0.05 + 0.85),
    ("basketball", "centre-line", NORTH, 7.5 + 0.05 + 0.15),
    ("basketball", "throw-in-line-east", EAST, 14 - 8.325 + 0.05),
    # World Athletics TR14: eight lanes of 1.22 m outside a kerb of 36.50 m
    ("athletics-400", "lane-8-back", NORTH, 36.50 + 8 * 1.22),
    ("athletics-400", "lane-1-back", NORTH, 36.50 + 1.22),
    ("athletics-400", "finish-line", WEST, 84.39 / 2),
    ("athletics-400", "start-100", WEST, 84.39 / 2 - 100),
    ("athletics-400", "start-110", WEST, 84.39 / 2 - 110),
    # OBR 2.01: batter's boxes 6 inches from a plate of 17, 4 by 6 feet; catcher's box 43 inches by 8 feet
    ("baseball-infield", "batters-box-right-inner", WEST, (8.5 + 6) * INCH),
    ("baseball-infield", "batters-box-right-outer", EAST, (8.5 + 6 + 48) * INCH),
    ("baseball-infield", "batters-box-right-front", NORTH, (8.5 + 36) * INCH),
    ("baseball-infield", "batters-box-right-back", SOUTH, (8.5 - 36) * INCH),
    ("baseball-infield", "catchers-box-rear", SOUTH, -8 * FOOT),
    ("baseball-infield", "catchers-box-right", EAST, 43 / 2 * INCH),
    ("baseball-infield", "grass-line", NORTH, (60.5 + 95) * FOOT + 2 * INCH),
]


@pytest.mark.parametrize(("name", "mark", "edge", "at_m"), DIMENSIONS)
def test_a_mark_lies_where_the_rules_have_it(name: str, mark: str, edge: int, at_m: float) -> None:
    assert paint(field(name), mark).bounds[edge] == pytest.approx(at_m, abs=1e-4)


def test_the_table_of_dimensions_names_every_sport() -> None:
    assert {row[0] for row in DIMENSIONS} == set(line_templates()) - {"soccer-11", "study-square"}


def test_painted_lengths() -> None:
    """Sums over the rules' figures, strokes running in the middle of their lines."""
    w = 0.05
    tennis = 2 * 23.77 + 2 * (10.97 - w) + 2 * (23.77 - w) + 2 * (8.23 - w) + 2 * (6.40 - w / 2) + 2 * 0.10
    assert field("tennis").length_m == pytest.approx(tennis)
    radii = [36.50 + 1.22 * lane - 0.025 for lane in range(1, 9)]
    ovals = sum(2 * 84.39 + 2 * math.pi * radius for radius in radii)
    straights = 8 * 17.0 + 9 * (110 + 3 - 84.39)
    lines = 3 * 8 * 1.22 + 15 * 1.17
    assert field("athletics-400").length_m == pytest.approx(ovals + straights + lines)
    yard_lines = 19 * (160 * FOOT - 8 * INCH) + 2 * 160 * FOOT
    border = 2 * (360 * FOOT + 8 * INCH) + 2 * (160 * FOOT + 4 * INCH)
    hashes = (4 * 80 + 2) * 2 * FOOT
    bare = load_template("american-football", {"numbers": False})
    assert bare.length_m == pytest.approx(yard_lines + border + hashes)


def test_american_football_has_every_number_and_hash() -> None:
    ids = [segment.id for segment in field("american-football").segments]
    assert sum(name.startswith(("hash-", "sideline-south-", "sideline-north-")) for name in ids) == 4 * 80
    numbers = {name.rsplit("-", 2)[0] for name in ids if name.startswith("number-") and "arrow" not in name}
    spots = [f"{half}-{ten}" for half in ("west", "east") for ten in (10, 20, 30, 40)] + ["50"]
    assert numbers == {f"number-{row}-{spot}" for row in ("north", "south") for spot in spots}
    arrows = {name.rsplit("-", 2)[0] for name in ids if "arrow" in name}
    assert len(arrows) == 16 and not any(name.endswith("-50") for name in arrows)


@pytest.mark.parametrize("lanes", [4, 8, 9])
def test_every_lane_runs_its_distance(lanes: int) -> None:
    """From the far edge of each painted start line along the lane's running line to the near edge of the finish."""
    track = AthleticsTrack(lanes=lanes)
    template = load_template("athletics-400", {"lanes": lanes})
    straight = 84.39
    assert straight_m(track) == straight
    assert 2 * straight + 2 * math.pi * 36.80 == pytest.approx(400.0, abs=0.01)
    for distance, bends in ((200, 1), (400, 2)):
        for lane in range(1 if bends == 1 else 2, lanes + 1):
            curve = stroke(template, f"start-{distance}-lane-{lane}").curve()
            center_x = straight / 2 if distance == 400 else -straight / 2
            radius = run_radius_m(track, lane)
            x, y, _, _ = curve.at(radius - math.hypot(curve.x_m - center_x, curve.y_m))
            angle = math.atan2(float(y), float(x) - center_x)
            begun = (angle + math.pi / 2) if distance == 400 else (angle - math.pi / 2) % (2 * math.pi)
            run = bends * (straight + math.pi * radius) - (begun * radius - 0.025)
            assert run == pytest.approx(bends * (straight + math.pi * 36.80), abs=1e-6)


def test_staggers_are_the_published_ones() -> None:
    """World Athletics Facilities Manual, 400 m with both bends in lanes."""
    published = [7.04, 14.70, 22.37, 30.03, 37.70, 45.37, 53.03]
    assert [stagger_m(AthleticsTrack(), lane, 2) for lane in range(2, 9)] == pytest.approx(published, abs=0.01)


def test_the_hockey_broken_line_has_dashes_of_300_mm_and_gaps_of_3_m() -> None:
    template = field("field-hockey")
    dashes = [s for s in template.segments if s.id.startswith("broken-line-west")]
    assert len(dashes) == 19
    assert [s.curve().length_m for s in dashes] == pytest.approx([0.3] * 19)
    ring = Point(-45.70, 1.83).buffer(19.63 - 0.0375, quad_segs=4096)
    gaps = []
    for first, second in itertools.pairwise(dashes):
        end, start = first.curve().end, second.curve()
        ends = [ring.exterior.project(Point(p)) for p in (end[:2], (start.x_m, start.y_m))]
        gaps.append(abs(ends[1] - ends[0]))
    assert gaps[:8] == pytest.approx([3.0] * 8, abs=2e-3)  # those on the north quarter


def test_baseball_foul_lines_and_bases() -> None:
    """The outer edge of each foul line is the side of the 90-foot square, so bases lie inside it."""
    template = field("baseball-infield")
    for base, sign in (("first", 1), ("third", -1)):
        corner = 90 * FOOT / math.sqrt(2)
        line = paint(template, f"foul-line-{base}")
        assert line.distance(Point(sign * corner, corner)) < 1e-6
        inward = 2 * INCH / math.sqrt(2)
        assert line.contains(Point(sign * (corner - inward), corner + inward))
        assert not line.contains(Point(sign * (corner + 0.01), corner - 0.01))


@pytest.mark.parametrize("name", shipped_templates())
def test_generated_json_is_the_template(name: str) -> None:
    assert parse_template(field(name).to_json()) == field(name)


@pytest.mark.parametrize("name", shipped_templates())
def test_every_parameter_has_a_range_that_is_enforced_and_told(name: str) -> None:
    for parameter in FIELDS[name].parameters:
        assert parameter.description
        if parameter.least is None or parameter.most is None:
            with pytest.raises(SpecError, match="give true or false"):
                FIELDS[name].template({parameter.name: "perhaps"})
            continue
        assert parameter.least <= parameter.default <= parameter.most
        for outside in (parameter.least * 0.9, parameter.most * 1.1):
            with pytest.raises(SpecError) as told:
                FIELDS[name].template({parameter.name: outside})
            assert parameter.name in str(told.value)
            assert f"give {parameter.least:g} to {parameter.most:g}" in str(told.value)


def test_unknown_and_contradicting_parameters_are_told() -> None:
    with pytest.raises(SpecError, match="lenght is not a parameter; use one of: length, width, line_width"):
        load_template("soccer-11", {"lenght": 100})
    with pytest.raises(SpecError, match="study-square has none"):
        load_template("study-square", {"length": 2})
    with pytest.raises(SpecError, match="must be greater than the width"):
        load_template("soccer-11", {"length": 90, "width": 90})


def test_parameters_change_the_field() -> None:
    small = load_template("soccer-11", {"length": "90", "width": "45", "line_width": 0.1})
    assert small.title.endswith("90 x 45 m")
    assert paint(small, "goal-line-east").bounds[EAST] == pytest.approx(45.0)
    assert paint(small, "penalty-area-west-front").bounds[EAST] == pytest.approx(-45.0 + 16.5)
    assert paint(small, "penalty-area-west-front").bounds[NORTH] == pytest.approx(20.16)
    wide = load_template("tennis", {"baseline_width": 0.10})
    both = paint(wide, "baseline-east-1").union(paint(wide, "baseline-east-2"))
    assert both.bounds[WEST] == pytest.approx(23.77 / 2 - 0.10)
    assert both.bounds[EAST] == pytest.approx(23.77 / 2)
    single = load_template("tennis", {"doubles": False})
    assert paint(single, "singles-sideline-north").bounds[NORTH] == pytest.approx(8.23 / 2)


def test_the_documentation_names_every_template() -> None:
    text = (Path(__file__).parents[2] / "docs" / "reference" / "templates.md").read_text(encoding="utf-8")
    rows = text[text.index("| `american-football`") :].partition("\n\n")[0].splitlines()
    assert [line.split("`")[1] for line in rows] == list(shipped_templates())
