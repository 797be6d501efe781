"""The examples of the documentation and of `examples/` can be read."""

import re
from pathlib import Path

import pytest

from touchline.schemas.catalogue import parse_template
from touchline.schemas.scenario import Scenario
from touchline.schemas.spec import parse, read_text
from touchline.schemas.team import TeamScenario

ROOT = Path(__file__).parents[2]
OTHERS = {"small-robot.json", "three-robots.json"}
EXAMPLES = sorted(path for path in (ROOT / "examples").glob("*.json") if path.name not in OTHERS)


def examples(page: str) -> list[str]:
    """The JSON texts of a page of the reference."""
    text = (ROOT / "docs" / "reference" / page).read_text(encoding="utf-8")
    return re.findall(r"```json\n(.*?)```", text, re.DOTALL)


def test_the_examples_are_scenarios() -> None:
    scenario, crowded = (parse(Scenario, text, "example") for text in examples("scenarios.md"))
    assert [each.kind for each in crowded.objects] == ["goal", "person", "ball"]
    assert [fault.kind for fault in scenario.faults] == ["corrections-lost", "messages-late", "wheel-slip", "bumper"]
    assert scenario.sky and scenario.steel


def test_the_example_is_a_template() -> None:
    (only,) = examples("templates.md")
    template = parse_template(only, "the page")
    assert [area.id for area in template.areas] == ["lawn"]
    assert template.area_m2 == pytest.approx(156.0)


def test_the_example_is_a_team() -> None:
    (only,) = examples("teams.md")
    assert parse(TeamScenario, only, "the page").names == ("a", "b")


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.name)
def test_every_example_that_comes_along_is_a_scenario(path: Path) -> None:
    scenario = parse(Scenario, read_text(path), path.name)
    assert scenario != Scenario(name=scenario.name)
