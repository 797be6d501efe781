"""The study of obstacles, on few lines, and its command."""

import json
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.command import app
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.free_space.ground_ways import GroundWays
from touchline.services.planner.geometry.clothoid import PathPose
from touchline_research.obstacles import obstacles_study, ways_to_goals
from touchline_research.obstacles.barn_figures import PUBLISHED, BarnFigures, barn_table
from touchline_research.obstacles.crowd import EIGHT, protected
from touchline_research.obstacles.free_worlds import random_pose, world
from touchline_research.obstacles.obstacles_study import Extent, ObstaclesStudy, run_obstacles_study
from touchline_research.obstacles.ompl_search import INSTALL, FoundWay, OmplProcess, has_ompl, search_way
from touchline_research.obstacles.protected_lines import CROWDS, PASSIVE, RULES, LineRuns, drive_line, marker
from touchline_research.obstacles.speed_zones import APPROACH, BOXES, CIRCLES, GROWING_CIRCLE, SpeedZones, watch_zones
from touchline_research.obstacles.ways_to_goals import OURS, RADIUS_M, Trial, bit_star, try_ways, ways_table
from touchline_research.target_table import TargetRow, TargetTable, against_targets

BOXED = next(rule for rule in RULES if rule.zones.kind == BOXES and rule.zones.slow_m > rule.zones.stop_m)


def allowed_mps(zones: SpeedZones, *places: tuple[float, float]) -> float:
    """Speed that zones allow a marker at the origin that sees four hits in one place each."""
    vehicle = marker()
    computer = protected(vehicle)
    computer.times.tick = 0
    points = np.repeat(np.array(places, dtype=np.float64).reshape(-1, 2), 4, axis=0)
    watch_zones(computer.array, zones, np.array(vehicle.body.footprint_m), points)
    assert computer.way.limit_mps == computer.way.cap_mps
    return computer.way.cap_mps / computer.way.fastest_mps


@pytest.mark.parametrize(
    ("place", "share"),
    [
        ((1.3, 0.0), 0.0),
        ((1.4, 0.0), 0.3),
        ((2.2, 0.0), 0.3),
        ((2.3, 0.0), 1.0),
        ((1.0, 0.65), 1.0),
        ((-0.4, 0.0), 1.0),
    ],
)
def test_boxes_stop_and_slow_for_what_is_ahead(place: tuple[float, float], share: float) -> None:
    assert allowed_mps(SpeedZones(BOXES, 0.6, 1.5), place) == pytest.approx(share)


def test_circles_act_all_round_and_the_others_by_distance() -> None:
    circles, growing, approach = (
        SpeedZones(CIRCLES, 0.6, 1.5),
        SpeedZones(GROWING_CIRCLE, 0.05),
        SpeedZones(APPROACH, 0.05, ahead_s=2),
    )
    assert [allowed_mps(circles, (0.2 - off, 0.0)) for off in (1.2, 1.3, 2.2)] == pytest.approx([0.0, 0.3, 1.0])
    assert [allowed_mps(each) for each in (circles, growing, approach)] == [1.0, 1.0, 1.0]
    for zones in (growing, approach):
        speeds = [allowed_mps(zones, (0.75 + off, 0.0)) for off in (0.02, 0.7, 1.2, 5.0)]
        assert speeds[0] == 0.0 < speeds[1] < speeds[2] < speeds[3] == 1.0


def test_three_hits_are_too_few_for_boxes() -> None:
    vehicle = marker()
    computer = protected(vehicle)
    computer.times.tick = 0
    body = np.array(vehicle.body.footprint_m)
    for count, stops in ((3, False), (4, True)):
        watch_zones(computer.array, BOXED.zones, body, np.tile((1.0, 0.0), (count, 1)))
        assert (computer.way.cap_mps == 0.0) == stops


def test_boxes_touch_people_in_motion_and_ours_does_not() -> None:
    met = {rule.name: [drive_line(rule, EIGHT, seed) for seed in (1, 2)] for rule in (PASSIVE, BOXED)}
    ours, boxed = met[PASSIVE.name], met[BOXED.name]
    assert sum(each.moving for each in ours) == 0 < sum(each.standing for each in ours)
    assert sum(each.moving for each in boxed) > 5
    assert all(each.way_m >= 60.0 for each in (*ours, *boxed))
    assert LineRuns(CROWDS[2], BOXED, tuple(boxed), 43.6, 0.0).row().met is None
    assert not LineRuns(CROWDS[2], PASSIVE, tuple(boxed), 43.6, 0.0).row().met


def trial(manoeuvres: int, **lengths_m: float | None) -> Trial:
    start, goal = PathPose(0.0, 0.0, 0.0), PathPose(3.0, 0.0, 0.0)
    names = {"ours": OURS, "bit": bit_star(5.0)}
    ways = {names[n]: None if m is None else FoundWay(m, 0.1, np.zeros((2, 2))) for n, m in lengths_m.items()}
    return Trial(0, start, goal, manoeuvres, ways)


@pytest.mark.parametrize(
    ("trials", "met"),
    [
        ([trial(3, ours=3.0, bit=3.5), trial(4, ours=3.0, bit=None)], True),
        ([trial(3, ours=3.0, bit=3.5), trial(3, ours=3.0, bit=2.9)], False),
        ([trial(21, ours=3.0, bit=2.9)], True),
        ([trial(3, ours=3.0, bit=3.5), trial(0, ours=None, bit=2.9)], False),
    ],
)
def test_ours_has_to_find_all_ways_and_none_longer_than_the_long_search(trials: list[Trial], met: bool) -> None:
    ours, other = ways_table(trials, (5.0,)).rows
    assert (ours.met, other.met) == (met, None)


def test_without_the_peer_its_rows_are_left_out_and_how_to_install_it_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ways_to_goals, "has_ompl", lambda: False)
    found = try_ways(1, 1, (0.2,), lambda what, done: None)
    assert [each.seed for each in found] == [0]
    table = ways_table(found, (0.2,))
    assert INSTALL in table.note
    assert [each.met for each in table.rows] == [True, None]
    assert [each.figures["found"] for each in table.rows] == [1, 1]


@pytest.mark.skipif(not has_ompl(), reason="OMPL is not installed")
def test_the_peer_drives_a_car_of_the_same_body() -> None:
    outline, rng = Vehicle().body.footprint_m, np.random.default_rng(1003)
    ground = world(3)
    start, goal = random_pose(rng, ground, outline), random_pose(rng, ground, outline)
    body = GroundWays(ground, outline, 0.0).body
    way = search_way(body, RADIUS_M, "RRTConnect", (start, goal), 5.0)
    assert way is not None
    steps = np.hypot(*np.diff(way.places, axis=0).T)
    assert way.length_m == pytest.approx(steps.sum(), rel=0.02)
    assert way.length_m >= abs(goal.point - start.point)
    assert (way.places[0], way.places[-1]) == (pytest.approx(start[:2]), pytest.approx(goal[:2]))


class EndingPool:
    """Pool whose process ends before it answers, the first times."""

    def __init__(self, endings: int) -> None:
        self.endings = endings

    def submit(self, *asked: object) -> Future[str]:
        answer: Future[str] = Future()
        self.endings -= 1
        if self.endings >= 0:
            answer.set_exception(BrokenProcessPool())
        else:
            answer.set_result("found")
        return answer

    def shutdown(self) -> None:
        pass


@pytest.mark.parametrize("endings", [0, 2, 5])
def test_a_search_is_tried_again_if_its_process_ends(endings: int, monkeypatch: pytest.MonkeyPatch) -> None:
    pool = EndingPool(endings)
    monkeypatch.setattr("touchline_research.obstacles.ompl_search._pool", lambda: pool)
    body = GroundWays(world(3), Vehicle().body.footprint_m, 0.0).body
    asked = body, RADIUS_M, "BITstar", (PathPose(0.0, 0.0, 0.0), PathPose(1.0, 0.0, 0.0)), 0.1
    with OmplProcess() as ompl:
        if endings < 5:
            assert ompl.way(*asked) == "found"
        else:
            with pytest.raises(BrokenProcessPool):
                ompl.way(*asked)


def test_barn_figures_are_as_published_and_ours_are_held_to_its_targets() -> None:
    assert [each.success_pct + each.collision_pct + each.timeout_pct for each in PUBLISHED] == [pytest.approx(100.0)]
    assert not any(row.must for row in barn_table().rows)
    good = BarnFigures("ours", 99.0, 0.0, 1.0, 0.43, 13.0)
    for ours, met in ((good, True), (good._replace(collision_pct=0.2), False), (good._replace(score=0.41), False)):
        rows = barn_table(ours).rows
        assert [row.met for row in rows] == [met, None]


@pytest.fixture(scope="module")
def study() -> ObstaclesStudy:
    said: dict[str, float] = {}
    result = run_obstacles_study(Extent(1, 3, 1, (0.2,)), lambda what, done: said.update({what: done}))
    assert all(0.0 <= done < 1.0 for done in said.values())
    return result


@pytest.mark.full
@pytest.mark.timeout(400)
def test_only_rows_of_ours_have_targets(study: ObstaclesStudy) -> None:
    assert len(study.tables) == 3
    for table in study.tables:
        assert all(len(each.texts) == len(table.headings) for each in table.rows)
        assert all(each.cells[0].startswith("ours") for each in table.rows if each.met is not None)


@pytest.mark.full
@pytest.mark.timeout(400)
@pytest.mark.parametrize(("met", "code"), [(True, 0), (False, 1)])
def test_a_missed_row_makes_the_exit_code(
    met: bool, code: int, study: ObstaclesStudy, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    table = TargetTable("what", ("name",), (TargetRow(("ours",), *against_targets([("≤ 1", met)])),))
    found = ObstaclesStudy((table,), study.lines, study.trials)
    monkeypatch.setattr(obstacles_study, "run_obstacles_study", lambda extent, progress: found)
    told = ["study", "obstacles", "--quick", "--json", "--out", str(tmp_path), "--plots", str(tmp_path)]
    result = CliRunner().invoke(app, told)
    assert result.exit_code == code
    assert [each["met"] for each in json.loads(result.stdout)[0]["rows"]] == [met]
    assert (tmp_path / "obstacles-study.md").read_text().startswith("## what")
    assert len(list(tmp_path.glob("obstacles-*.png"))) == 2
