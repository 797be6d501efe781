"""Degrees in place of radians are refused wherever people and programs give an angle, and told what to give."""

import math

import numpy as np
import pytest

from touchline.cli.goto_command import GoalChoice
from touchline.cli.sweep_subject import SubjectChoice
from touchline.jobs.sweep.combinations import cases
from touchline.schemas.cdr import decode, encode
from touchline.schemas.errors import PayloadError, PlanningError, SpecError
from touchline.schemas.fleet import Fleet
from touchline.schemas.log_mapping import LogMapping
from touchline.schemas.messages import GotoRequest, PlanOptions, PoseGoal
from touchline.schemas.scenario import Scenario
from touchline.schemas.spec import parse
from touchline.schemas.team import TeamScenario
from touchline.schemas.template import Template
from touchline.schemas.vehicles.rear_steered_drive import RearSteeredDrive
from touchline.services.planner.given_pose import pose_of

HALF_TURN = r"in radians, not degrees: 3\.14159"
ARC = '{"id": "a", "arc": {"start": [1, 0], "center": [0, 0], "sweep_angle": 180}}'
START = '{"x_m": 0, "y_m": 0, "heading_rad": 180}'


@pytest.mark.parametrize(
    ("kind", "text", "field"),
    [
        (Scenario, f'{{"start": {START}}}', "start.heading_rad"),
        (Scenario, '{"ground": {"uphill_rad": 180}}', "ground.uphill_rad"),
        (Template, f'{{"name": "t", "segments": [{ARC}]}}', "segments[0].arc.sweep_angle"),
        (LogMapping, '{"heading": {"start_rad": 180}}', "heading.start_rad"),
        (
            TeamScenario,
            '{"task": {"kind": "formation", "x_m": 0, "y_m": 0, "heading_rad": 180}}',
            "heading_rad",
        ),
        (Fleet, f'{{"robots": [{{"namespace": "r1", "scenario": {{"start": {START}}}}}]}}', "heading_rad"),
        (RearSteeredDrive, '{"kind": "rear-steered", "max_steering_rad": 180}', "max_steering_rad"),
    ],
)
def test_files_are_refused_with_the_angle_in_radians(kind, text, field):
    with pytest.raises(SpecError) as caught:
        parse(kind, text, "file.json")
    assert field in str(caught.value)
    assert "(in radians, not degrees: 3.14159)" in str(caught.value)


@pytest.mark.parametrize("given", [180.0, -90.0, 6.3, -7.0, 720.0])
def test_options_and_requests_refuse_what_is_beyond_a_full_turn(given):
    with pytest.raises(SpecError, match=r"HEADING is .*; give it in radians, not degrees: "):
        GoalChoice(0.0, 0.0, given).goal()
    with pytest.raises(SpecError, match=r"--goal is .*; give it in radians, not degrees: "):
        SubjectChoice(goal=f"1,2,{given}").chosen()
    with pytest.raises(SpecError, match=r"heading_rad is .*; give it in radians, not degrees: "):
        cases(PoseGoal(), Scenario(), PlanOptions(), {"goal.heading_rad": [0.0, given]})
    with pytest.raises(PlanningError, match=r"end heading of .* in radians, not degrees: "):
        pose_of("end", np.array([0.0, 0.0, given]))
    wrong = GotoRequest(goal=PoseGoal().model_copy(update={"heading_rad": given}))
    with pytest.raises(PayloadError, match=r"goal\.heading_rad: .*give it in radians, not degrees: "):
        decode(GotoRequest, encode(wrong))


@pytest.mark.parametrize("given", [0.0, math.pi, -2.0 * math.pi, 2.0 * math.pi, math.nan])
def test_angles_within_a_full_turn_and_any_heading_are_taken(given):
    asked = GotoRequest(goal=PoseGoal(heading_rad=given))
    assert decode(GotoRequest, encode(asked)) == asked
    heading_rad = GoalChoice(0.0, 0.0, None if math.isnan(given) else given).goal().heading_rad
    assert heading_rad == pytest.approx(given, nan_ok=True)


def test_the_remedy_is_the_same_angle():
    with pytest.raises(SpecError, match=HALF_TURN):
        GoalChoice(-3.0, 0.0, 180.0).goal()
    with pytest.raises(SpecError, match=r"not degrees: 1\.5708"):
        GoalChoice(-3.0, 0.0, 450.0).goal()
