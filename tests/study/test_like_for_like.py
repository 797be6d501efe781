"""DPP and ours like for like: on a small template, and what a row that is missed does to the command."""

import pytest
from typer.testing import CliRunner

from tests.command import app
from touchline.schemas.catalogue import load_template
from touchline.schemas.messages import PlanOptions
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.limits import Limits
from touchline.services.planner.steering.g2 import Steering
from touchline.services.planner.transitions.transitions import TransitionFamily
from touchline_research.driven_template import DPP, study_vehicle
from touchline_research.durations import painting_seconds
from touchline_research.like_for_like import (
    LAW,
    Match,
    Setting,
    dubins_padded,
    in_order_of,
    match_rows,
    matches,
)
from touchline_research.pitch import Pitch
from touchline_research.run import Study
from touchline_research.table import Cause

pytestmark = pytest.mark.xdist_group("like for like")  # by one worker, so that the court is planned once
CAUSES = [Cause("everything", 2.0, 1.0, 2.0)]


@pytest.fixture(scope="module")
def court() -> Pitch:
    return Pitch(load_template("tennis"), study_vehicle())


@pytest.fixture(scope="module")
def matched(court: Pitch) -> dict[Setting, Match]:
    return matches({LAW: court})


def of_weak_wheels(pitch: Pitch) -> Pitch:
    """DPP, which is forgiven its steps, gains by wheels that hardly turn the robot."""
    weak = {"max_wheel_acceleration_radps2": 3.0, "planned_wheel_acceleration_radps2": 3.0}
    return Pitch(pitch.template, pitch.vehicle.changed(drive=weak))


def test_at_the_speed_and_curvature_of_the_study_it_is_the_dpp_of_the_study(court: Pitch) -> None:
    options = PlanOptions(paint_speed_mps=1.5, transit_speed_mps=1.5, kappa_max_1pm=1.125)
    seconds, driven = dubins_padded(court, Limits.of(court.vehicle, options))
    assert seconds == pytest.approx(court.drive(DPP).seconds(1.5), rel=1e-6)
    assert driven.length_m == pytest.approx(court.drive(DPP).length_m, rel=1e-6)


def test_ours_is_faster_on_a_court_and_its_wheels_can_do_it(matched: dict[Setting, Match]) -> None:
    assert len(matched) == 4
    assert all(each.met and each.ours_kept and each.dpp_steps > 0 for each in matched.values())


def test_a_plan_is_painted_as_fast_when_its_order_is_given(court: Pitch) -> None:
    ordered = court.plan(order="optimised", transit_speed_mps=2.0)
    again = in_order_of(court, ordered).plan(order="given", transit_speed_mps=2.0)
    assert [s.stroke.id for s in again.sections if s.stroke] == [s.stroke.id for s in ordered.sections if s.stroke]
    assert painting_seconds(again) == pytest.approx(painting_seconds(ordered), abs=1e-3)


def test_turns_that_brake_are_offered_where_only_the_wheels_limit_turns() -> None:
    """The shipped robot's tyres bear 1.2 m/s² across, less than its wheels could make: its plans have none."""
    for vehicle, more in ((Vehicle(), 0), (study_vehicle(), 1)):
        limits = Limits.of(vehicle, PlanOptions(paint_speed_mps=1.5, transit_speed_mps=2.0))
        turns = TransitionFamily.by_time(Steering, limits).turns
        assert limits.drive_limits_turns == bool(more)
        tightest = [t for t in turns if t.curvature_1pm == turns[0].curvature_1pm and t.speed_mps == 1.5]
        assert len(tightest) == more


def test_the_command_fails_if_a_row_is_missed_and_only_then(
    court: Pitch, matched: dict[Setting, Match], monkeypatch: pytest.MonkeyPatch
) -> None:
    for found, code in ((matched, 0), (matches({LAW: of_weak_wheels(court)}), 1)):
        study = Study(match_rows(found), CAUSES, court, {})
        monkeypatch.setattr("touchline_research.run.run_study", lambda *_, study=study: study)
        assert CliRunner().invoke(app, ["study", "--quick"]).exit_code == code
