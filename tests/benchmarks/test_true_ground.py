"""Raster of the ground that a tool has passed over in truth."""

import numpy as np
import pytest

from benchmarks._true_ground import covered_cells, untrue_m2
from touchline.schemas.messages import PaintMarks
from touchline.schemas.template import Template

YARD = Template.model_validate({"name": "yard", "areas": [{"id": "yard", "outline": [[0, 0], [4, 0], [4, 2], [0, 2]]}]})
ALONG = PaintMarks(x_m=np.array([0.0, 4.0]), y_m=np.array([0.5, 0.5]), width_m=1.0)
REST = [[0, 1], [4, 1], [4, 2], [0, 2]]


def test_covered_ground_is_that_under_the_tool() -> None:
    assert covered_cells(YARD, [ALONG]).size_m2 == pytest.approx(4.0, abs=0.2)


def test_a_report_is_untrue_by_what_it_leaves_out_and_by_what_it_invents() -> None:
    cells = covered_cells(YARD, [ALONG])
    assert untrue_m2(cells, [REST]) == 0.0
    assert untrue_m2(cells, []) == pytest.approx(4.0, abs=0.3)
    assert untrue_m2(cells, [REST, [[0, 0], [2, 0], [2, 1], [0, 1]]]) == pytest.approx(2.0, abs=0.5)
