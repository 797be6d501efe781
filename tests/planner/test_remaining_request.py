"""Requests for plans of what remains of a template's areas."""

import json

import numpy as np
import pytest

from touchline.schemas.ground_piece import GroundPiece, RemainingPieces
from touchline.schemas.messages import PlanOptions, PlanRequest, PoseGoal
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.request import answer

pytestmark = pytest.mark.xdist_group("coverage")  # its kernels are compiled in one worker

YARD = json.dumps({"name": "yard", "areas": [{"id": "yard", "outline": [[0, 0], [12, 0], [12, 8], [0, 8]]}]})
SWEEPER = Vehicle.model_validate({"name": "sweeper", "tool": {"kind": "roller", "rolled_width_m": 1.0}})
QUICK = PlanOptions(coverage_pct=60.0, laps=0, swath_angle_deg=np.array([0.0]))
HALF = ((0.0, 0.0), (6.0, 0.0), (6.0, 8.0), (0.0, 8.0))


def remaining(corners: tuple[tuple[float, float], ...] = HALF, area: str = "yard") -> str:
    return RemainingPieces(pieces=(GroundPiece(area=area, corners=corners),)).model_dump_json()


def test_only_the_remaining_pieces_are_planned() -> None:
    request = PlanRequest(template_json=YARD, options=QUICK)
    whole = answer(request, SWEEPER)
    rest = answer(request.model_copy(update={"remaining_json": remaining()}), SWEEPER)
    assert whole.success and rest.success, whole.message or rest.message
    assert 0.3 < rest.report.paint_length_m / whole.report.paint_length_m < 0.7


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"remaining_json": "["}, "is not JSON"),
        ({"remaining_json": "[]"}, "give a JSON object"),
        ({"remaining_json": '{"pieces": []}'}, "remaining ground: pieces"),
        ({"remaining_json": remaining(area="lawn")}, 'has a remaining piece of "lawn"'),
        ({"remaining_json": remaining(((0, 0), (6, 8), (6, 0), (0, 8)))}, "whose outline crosses itself"),
        ({"remaining_json": remaining(), "template_json": "", "goal": (PoseGoal(),)}, "a goal and remaining ground"),
    ],
)
def test_remaining_ground_that_cannot_be_used_is_refused(changes: dict[str, object], words: str) -> None:
    response = answer(PlanRequest(template_json=YARD).model_copy(update=changes), SWEEPER)
    assert not response.success and words in response.message, response.message


def test_remaining_ground_is_for_a_tool_that_covers() -> None:
    response = answer(PlanRequest(template_json=YARD, remaining_json=remaining()), Vehicle())
    assert not response.success and "does not cover" in response.message, response.message
