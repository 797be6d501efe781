"""Combinations of a sweep's settings."""

import itertools
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from pydantic import ValidationError

from touchline.schemas.errors import SpecError
from touchline.schemas.messages import PlanOptions
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.scenario import Scenario
from touchline.schemas.spec import first_problem, parse

Setting = dict[str, Any]
"""Values by dotted name: a field of the scenario (``gnss.white_m``), ``template``, ``follower``, ``plan.`` and an
option, or ``onboard.`` and a field of the robot's computer (``onboard.gnss.white_m``)."""

TEMPLATE: Final = "template"
FOLLOWER: Final = "follower"
PLAN_PREFIX: Final = "plan."
ONBOARD_PREFIX: Final = "onboard."


@dataclass(frozen=True)
class SweepCase:
    """One combination.

    Attributes:
        setting: The values that tell it from the others.
        scenario: Its seed is the first of the sweep's.
    """

    setting: Setting
    template: str
    scenario: Scenario
    config: OnboardConfig
    options: PlanOptions


def parse_settings(texts: Sequence[str]) -> dict[str, list[Any]]:
    """``name=value,value,…`` each, as values by name; numbers, true and false are read as such.

    Raises:
        SpecError: A text has another form, or a name comes twice.
    """
    settings: dict[str, list[Any]] = {}
    for text in texts:
        name, equals, values = text.partition("=")
        if not equals or not name or not all(values.split(",")):
            raise SpecError("command line", "--set", f"is {text!r}", "give NAME=VALUE,VALUE…")
        if name in settings:
            raise SpecError("command line", "--set", f"names {name!r} twice", "give all of its values at once")
        settings[name] = [_value(value) for value in values.split(",")]
    return settings


def cases(
    template: str,
    scenario: Scenario,
    options: PlanOptions,
    settings: Mapping[str, Sequence[Any]],
    config: OnboardConfig | None = None,
) -> list[SweepCase]:
    """Every combination of ``settings``, the last name's values changing fastest.

    Args:
        template: To be worked on where the settings name none.
        scenario: As it is where the settings do not change it.
        options: Of plans, likewise.
        settings: Values by name.
        config: Of the robot's computer, likewise; by default the shipped robot's.

    Raises:
        SpecError: A name is not a field, or a value not allowed.
    """
    combinations = [dict(zip(settings, values, strict=True)) for values in itertools.product(*settings.values())]
    base = SweepCase({}, template, scenario, config or OnboardConfig(), options)
    return [_case(base, setting) for setting in combinations]


def _case(base: SweepCase, setting: Setting) -> SweepCase:
    lived, computer = base.scenario.model_dump(mode="json"), base.config.model_dump(mode="json")
    planned: dict[str, Any] = {}
    for name, value in setting.items():
        if name.startswith(PLAN_PREFIX):
            planned[name.removeprefix(PLAN_PREFIX)] = value
        elif name == FOLLOWER or name.startswith(ONBOARD_PREFIX):
            _put(computer, name, name.removeprefix(ONBOARD_PREFIX), value, "a robot's computer")
        elif name != TEMPLATE:
            _put(lived, name, name, value, "a scenario")
    unknown = sorted(set(planned) - set(PlanOptions.model_fields))
    if unknown:
        known = ", ".join(f"{PLAN_PREFIX}{field}" for field in PlanOptions.model_fields)
        raise SpecError(
            "command line", f"--set {PLAN_PREFIX}{unknown[0]}", "is not an option of a plan", f"use {known}"
        )
    try:
        chosen = PlanOptions.model_validate(base.options.model_dump() | planned)
    except ValidationError as error:
        raise first_problem(error, "--set plan", planned) from error
    painted = str(setting.get(TEMPLATE, base.template))
    world, config = parse(Scenario, json.dumps(lived), "--set"), parse(OnboardConfig, json.dumps(computer), "--set")
    return SweepCase(setting, painted, world, config, chosen)


def _put(fields: dict[str, Any], name: str, place: str, value: Any, owner: str) -> None:
    """Set the field at the dotted `place` to a value; `name` is what the setting calls it."""
    *path, last = place.split(".")
    for part in path:
        inner = fields.get(part)
        if not isinstance(inner, dict):
            raise SpecError("command line", f"--set {name}", f"has no {part!r} in {owner}", "mend its name")
        fields = inner
    if last not in fields:
        raise SpecError("command line", f"--set {name}", f"is not a field of {owner}", "mend its name")
    fields[last] = value


def _value(text: str) -> Any:
    try:
        return json.loads(text)
    except json.JSONDecodeError:
        return text
