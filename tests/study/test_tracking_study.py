"""The study of cubic paths and trajectory tracking, on few goals, and its command."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.command import app
from touchline.services.planner.poses.speed_laws import CUBIC, QUINTIC, UNIFORM
from touchline_research.target_table import TargetRow, TargetTable, against_targets
from touchline_research.tracking import tracking_study
from touchline_research.tracking.cubic_reference import SLOWER, timed_curve
from touchline_research.tracking.studied_robot import (
    SPEED_MPS,
    YAW_RADPS,
    goals_ahead,
)
from touchline_research.tracking.tracker_runs import by_choice, by_distance, by_study
from touchline_research.tracking.tracking_loop import STEP_S as CONTROL_STEP_S
from touchline_research.tracking.tracking_study import Counts, TrackingStudy, run_tracking_study

# With cold kernels on a busy machine the first use takes a minute or two.
pytestmark = [pytest.mark.full, pytest.mark.timeout(400), pytest.mark.xdist_group("tracking study")]

LEAST, TURNING, SET_UP, TRACKERS, ATTRACTION, SPEEDS = range(6)


@pytest.fixture(scope="module")
def study() -> TrackingStudy:
    said: dict[str, float] = {}
    result = run_tracking_study(Counts(20, 30, 3, 8, 5, 3), lambda what, done: said.update({what: done}))
    assert len(said) == len(result.tables) == 6
    assert all(0.0 <= done < 1.0 for done in said.values())
    return result


def row(study: TrackingStudy, table: int, begins: str) -> TargetRow:
    return next(each for each in study.tables[table].rows if each.cells[0].startswith(begins))


def test_only_rows_of_ours_are_judged_and_every_table_has_one(study: TrackingStudy) -> None:
    for table in study.tables:
        assert all(len(each.texts) == len(table.headings) for each in table.rows)
        assert any(each.met is not None for each in table.rows)
        for each in table.rows:
            ours = each.cells[0].startswith("ours") or each.cells[0] == "regularised"
            assert (each.met is not None) == bool(each.must) == ours


def test_chosen_tangents_are_quicker_and_wind_less(study: TrackingStudy) -> None:
    given, chosen = (row(study, LEAST, name).figures for name in ("k = 10", "ours: cubic"))
    assert given["mean_ratio"] == 1.0
    assert chosen["median_s"] < 0.8 * given["median_s"]
    assert chosen["slower"] == 0
    assert (
        row(study, LEAST, "chosen k, and").figures["median_s"] <= row(study, LEAST, "chosen k, f").figures["median_s"]
    )
    assert row(study, TURNING, "k = 10").figures["most_deg"] > 200.0
    assert row(study, TURNING, "ours").met


def test_giving_up_curves_slower_than_turning_never_costs_time(study: TrackingStudy) -> None:
    """Instead of a curve that is given up there is g2, which turns on the spot, too."""
    kept, ours = (row(study, LEAST, name).figures for name in ("the same", "ours: cubic"))
    assert ours["mean_ratio"] <= kept["mean_ratio"]
    assert ours["median_s"] <= row(study, LEAST, "turn, line").figures["median_s"]


def test_near_standstill_the_linear_law_asks_for_the_impossible(study: TrackingStudy) -> None:
    linear, ours = (row(study, TRACKERS, name).figures for name in ("linear", "ours"))
    assert linear["asked_radps"] > 10.0
    assert linear["asked_off_radps"] > 100.0
    assert linear["turned_p95_deg"] > 3.0
    assert linear["turned_most_deg"] >= linear["turned_p95_deg"]
    assert ours["asked_radps"] < ours["asked_off_radps"] < YAW_RADPS
    assert ours["turned_p95_deg"] < 1.0
    assert ours["end_p95_m"] < 3e-3
    assert ours["looks_ahead"] == 3
    assert row(study, SET_UP, "the study: k = 10, linear, cubic").figures["asked_off_radps"] > 50.0
    assert row(study, SET_UP, "ours").met


def test_only_the_law_that_sees_no_heading_ends_looking_back(study: TrackingStudy) -> None:
    assert row(study, ATTRACTION, "regularised").met
    assert row(study, ATTRACTION, "dynamic").figures["back"] > 0
    for name in ("linear", "linear-scaled", "nonlinear"):
        assert row(study, ATTRACTION, name).figures["back"] == 0


def test_passes_are_quicker_than_the_network_studys_law_and_end_at_rest(study: TrackingStudy) -> None:
    ours = row(study, SPEEDS, "ours")
    assert ours.figures["acceleration_mps2"] == pytest.approx(0.5, rel=1e-5)
    assert ours.figures["left_mps"] == 0.0
    assert ours.figures["off_m"] < 1e-9
    assert ours.met == (ours.figures["mean_s"] <= 6.0)
    for name in ("constant", "law4, p = 0.5", "law4, p = 1", "law4, p = 2"):
        figures = row(study, SPEEDS, name).figures
        assert figures["mean_s"] > ours.figures["mean_s"]
        assert figures["acceleration_mps2"] >= 2.0 - 1e-9
        assert figures["left_mps"] > 0.0


@pytest.mark.parametrize("law", [UNIFORM, CUBIC, QUINTIC])
def test_references_keep_the_limits_and_end_at_the_goal(law: object) -> None:
    for goal in goals_ahead(4, 1.0):
        for curve_to in (by_study, by_distance, by_choice):
            reference = timed_curve(curve_to(goal), law)  # type: ignore[arg-type]
            share = max(reference.speed_mps.max() / SPEED_MPS, np.abs(reference.yaw_rate_radps).max() / YAW_RADPS)
            assert share == pytest.approx(1.0 / SLOWER, rel=0.02)
            assert reference.poses[-1, :2] == pytest.approx((goal.x_m, goal.y_m))
            assert math.remainder(reference.poses[-1, 2] - goal.heading_rad, math.tau) == pytest.approx(0.0, abs=1e-9)
            steps = np.hypot(*np.diff(reference.poses[:, :2], axis=0).T)
            assert steps.max() <= CONTROL_STEP_S * SPEED_MPS / SLOWER * (1.0 + 1e-9)


def table_of(*asked: tuple[str, bool]) -> TargetTable:
    return TargetTable(
        "what", ("name", "figure"), (TargetRow(("a", "1 s")), TargetRow(("b", "2 s"), *against_targets(asked)))
    )


def test_a_row_is_met_if_all_that_is_asked_is() -> None:
    assert against_targets([]) == ("", None)
    assert against_targets([("≤ 1", True), ("≥ 0", False)]) == ("≤ 1, ≥ 0", False)
    assert not table_of(("≤ 2", True)).missed
    assert table_of(("≤ 1", False)).missed
    assert table_of(("|x| ≤ 1", False)).markdown().splitlines()[-1] == "| b | 2 s | \\|x\\| ≤ 1 | NO |"


@pytest.mark.parametrize(("met", "code"), [(True, 0), (False, 1)])
def test_a_missed_row_makes_the_exit_code(
    met: bool, code: int, study: TrackingStudy, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = TrackingStudy((table_of(("≤ 2 s", met)),), study.domains)
    monkeypatch.setattr(tracking_study, "run_tracking_study", lambda counts, progress: found)
    told = ["study", "tracking", "--quick", "--json", "--out", str(tmp_path), "--plots", str(tmp_path)]
    result = CliRunner().invoke(app, told)
    assert result.exit_code == code
    rows = json.loads(result.stdout)[0]["rows"]
    assert [each["met"] for each in rows] == [None, met]
    assert (tmp_path / "tracking-study.md").read_text().startswith("## what")
    assert len(list(tmp_path.glob("tracking-*.png"))) == 3
