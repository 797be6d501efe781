"""docs/reference/onboard.md names every field of the computer's configuration with its default and range."""

import json
import re
from pathlib import Path

import annotated_types
import pytest

from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.spec import Spec

TEXT = (Path(__file__).parents[2] / "docs" / "reference" / "onboard.md").read_text(encoding="utf-8")
ROWS = {cells[1].strip("` "): cells for cells in (line.split("|") for line in TEXT.splitlines()) if len(cells) == 6}
FIELDS = {name: field for name, field in OnboardConfig.model_fields.items() if not isinstance(field.default, Spec)}
FIELDS |= {
    f"{group}.{name}": field
    for group, owner in OnboardConfig.model_fields.items()
    if isinstance(owner.default, Spec)
    for name, field in type(owner.default).model_fields.items()
}
SIGNS = {annotated_types.Ge: ("≥", "ge"), annotated_types.Gt: (">", "gt"), annotated_types.Le: ("≤", "le")}


def test_the_table_has_the_fields_and_no_others():
    assert set(ROWS) - {"field", "---"} == set(FIELDS)


@pytest.mark.parametrize("name", FIELDS)
def test_the_default_is_the_one_told(name):
    assert json.loads(ROWS[name][2].strip(" `")) == FIELDS[name].default


@pytest.mark.parametrize("name", sorted(name for name in FIELDS if FIELDS[name].annotation is float))
def test_the_range_is_the_one_that_is_held(name):
    held = {(SIGNS[type(b)][0], float(getattr(b, SIGNS[type(b)][1]))) for b in FIELDS[name].metadata}
    told = {(sign, float(number)) for sign, number in re.findall(r"([>≤≥]) (-?[\d.]+)", ROWS[name][3])}
    assert told == held
    assert len(held) == 2
