"""docs/reference/scenarios.md names every field of a scenario with its default, and its example is one."""

import re
from pathlib import Path
from typing import get_args

import pytest

from touchline.schemas.faults import Fault
from touchline.schemas.scenario import Obstruction, Scenario, Steel
from touchline.schemas.spec import Spec, parse, read_text

OTHERS = {"small-robot.json", "three-robots.json"}
EXAMPLES = sorted(path for path in (Path(__file__).parents[2] / "examples").glob("*.json") if path.name not in OTHERS)
REFERENCE = Path(__file__).parents[2] / "docs" / "reference"
SCENARIO = (REFERENCE / "scenarios.md").read_text(encoding="utf-8")
FAULTS = (REFERENCE / "faults.md").read_text(encoding="utf-8")
ROWS = [line for line in SCENARIO.splitlines() if line.startswith("| `")]
GROUPS = {"sky[]": Obstruction, "steel[]": Steel}
GROUPS |= {
    name: type(field.default)
    for name, field in Scenario.model_fields.items()
    if isinstance(field.default, Spec) and name != "origin"
}


def row_of(field, group=""):
    pattern = rf"\| `{re.escape(group)}\." if group else r"\| "
    return [row for row in ROWS if re.match(pattern, row) and re.search(rf"[`.]{field}`", row.split("|")[1])]


@pytest.mark.parametrize("name", Scenario.model_fields)
def test_every_field_has_a_row(name):
    assert row_of(name) or any(name == group.removesuffix("[]") for group in GROUPS) or f"`{name}[]`" in SCENARIO


@pytest.mark.parametrize(
    "group, name", [(group, name) for group, model in GROUPS.items() for name in model.model_fields]
)
def test_every_figure_has_a_row_with_its_default(group, name):
    (row,) = row_of(name, group)
    default = GROUPS[group].model_fields[name].default
    if isinstance(default, float) and name != "field_t":
        shown = [float(number) for number in re.findall(r"\d+(?:\.\d+)?", row.split("|")[2])]
        assert default in shown
    elif isinstance(default, str) and default:
        assert f'"{default}"' in row


@pytest.mark.parametrize("model", get_args(get_args(Fault)[0]), ids=lambda model: model.__name__)
def test_every_fault_has_a_row_with_its_parameters(model):
    kind = get_args(model.model_fields["kind"].annotation)[0]
    (row,) = [line for line in FAULTS.splitlines() if line.startswith(f"| `{kind}`")]
    for name in model.model_fields:
        assert name in ("kind", "start_s", "duration_s") or f"`{name}`" in row


def test_the_example_is_a_scenario():
    (example,) = re.findall(r"```json\n(.*?)```", SCENARIO, re.DOTALL)
    scenario = parse(Scenario, example, "example")
    assert [fault.kind for fault in scenario.faults] == [
        "corrections-lost",
        "messages-late",
        "wheel-slip",
        "bumper",
    ]
    assert scenario.sky and scenario.steel


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.name)
def test_every_example_that_comes_along_is_a_scenario(path):
    assert parse(Scenario, read_text(path), path.name).faults
