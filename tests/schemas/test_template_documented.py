"""The page on templates names every field of a template's file, and its example is one."""

import re
from pathlib import Path

import pytest
from pydantic import BaseModel

from touchline.schemas.catalogue import parse_template
from touchline.schemas.template import ArcSpec, Area, LineSpec, Polygon, Template, TemplateSegment

PAGE = (Path(__file__).parents[2] / "docs" / "reference" / "templates.md").read_text(encoding="utf-8")
FIELDS = PAGE.split("## Fields")[1].split("\n## ")[0]


@pytest.mark.parametrize("kind", [Template, TemplateSegment, Area, LineSpec, ArcSpec, Polygon])
def test_every_field_is_named(kind: type[BaseModel]) -> None:
    table = "\n".join(line for line in FIELDS.splitlines() if line.startswith("|"))
    named = {word.split(".")[-1].removesuffix("[]") for word in re.findall(r"`([\w.\[\]]+)`", table)}
    assert set(kind.model_fields) <= named


def test_the_example_is_a_template() -> None:
    (example,) = re.findall(r"```json\n(.*?)```", FIELDS, re.S)
    template = parse_template(example, "the page")
    assert [area.id for area in template.areas] == ["lawn"]
    assert template.area_m2 == pytest.approx(156.0)
