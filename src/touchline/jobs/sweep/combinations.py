"""Combinations of a sweep's settings."""

import itertools
import json
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, TypeVar

from pydantic import ValidationError

from touchline.schemas.errors import SpecError
from touchline.schemas.messages import PlanOptions, PoseGoal
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.scenario import Scenario
from touchline.schemas.spec import EVERY_FIELD, parse, problems_of
from touchline.schemas.team import TeamScenario
from touchline.schemas.template import Template
from touchline.services.planner.goal_plan import GOAL_OPTIONS

Setting = dict[str, Any]
"""Values by dotted name: a field of the scenario (``gnss.white_m``), ``template``, ``follower``, ``plan.`` and an
option, ``goal.`` and a field of the goal, or ``onboard.`` and one of the robot's computer
(``onboard.gnss.white_m``)."""

M = TypeVar("M", PlanOptions, PoseGoal)

TEMPLATE: Final = "template"
FOLLOWER: Final = "follower"
PLAN_PREFIX: Final = "plan."
GOAL_PREFIX: Final = "goal."
ONBOARD_PREFIX: Final = "onboard."
RANDOM_FAULTS: Final = "random_faults"


@dataclass(frozen=True)
class SweepCase:
    """One combination.

    Attributes:
        setting: The values that distinguish it.
        work: The template, goal or team.
        scenario: Its seed is the first of the sweep's.
    """

    setting: Setting
    work: str | Template | PoseGoal | TeamScenario
    scenario: Scenario
    config: OnboardConfig
    options: PlanOptions


def parse_settings(texts: Sequence[str]) -> dict[str, list[Any]]:
    """Parse ``name=value,value,…`` texts to values by name; numbers, true and false are converted.

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
    work: str | Template | PoseGoal,
    scenario: Scenario,
    options: PlanOptions,
    settings: Mapping[str, Sequence[Any]],
    config: OnboardConfig | None = None,
) -> list[SweepCase]:
    """Return every combination of ``settings``, the last name's values changing fastest.

    Args:
        work: Default template, or the goal.
        scenario: Default scenario.
        options: Default planning options.
        settings: Values by name.
        config: Default configuration of the onboard computer; None: the shipped robot's.

    Raises:
        SpecError: A name is not a field, or a value not allowed.
    """
    combinations = [dict(zip(settings, values, strict=True)) for values in itertools.product(*settings.values())]
    base = SweepCase({}, work, scenario, config or OnboardConfig(), options)
    return [_case(base, setting) for setting in combinations]


def team_cases(teams: Sequence[TeamScenario], *, random_faults: bool) -> list[SweepCase]:
    """Return a case for each team, distinguished by its number of robots; with random faults each seed has its own."""
    fields = {RANDOM_FAULTS: True} if random_faults else {}
    return [
        SweepCase({"robots": len(team.names), **fields}, team, team.world, team.onboard, PlanOptions())
        for team in teams
    ]


def _case(base: SweepCase, setting: Setting) -> SweepCase:
    lived = base.scenario.model_dump(mode="json", context=EVERY_FIELD)
    computer = base.config.model_dump(mode="json", context=EVERY_FIELD)
    planned: dict[str, Any] = {}
    aimed: dict[str, Any] = {}
    for name, value in setting.items():
        if name.startswith(PLAN_PREFIX):
            planned[name.removeprefix(PLAN_PREFIX)] = value
        elif name.startswith(GOAL_PREFIX):
            aimed[name.removeprefix(GOAL_PREFIX)] = value
        elif name == FOLLOWER or name.startswith(ONBOARD_PREFIX):
            _put(computer, name, name.removeprefix(ONBOARD_PREFIX), value, "a robot's computer")
        elif name != TEMPLATE:
            _put(lived, name, name, value, "a scenario")
    assert not isinstance(base.work, TeamScenario), "a team has cases of its own"
    work = _work(base.work, setting, aimed)
    of_plans, owner = (
        (GOAL_OPTIONS, "a plan to a goal") if isinstance(work, PoseGoal) else (PlanOptions.model_fields, "a plan")
    )
    options = _changed(base.options, PLAN_PREFIX, planned, of_plans, f"an option of {owner}")
    world, config = parse(Scenario, json.dumps(lived), "--set"), parse(OnboardConfig, json.dumps(computer), "--set")
    return SweepCase(setting, work, world, config, options)


def _work(work: str | Template | PoseGoal, setting: Setting, aimed: Mapping[str, Any]) -> str | Template | PoseGoal:
    if not isinstance(work, PoseGoal):
        for name in aimed:
            remedy = "give --goal X,Y[,HEADING] in place of a template"
            raise SpecError("command line", f"--set {GOAL_PREFIX}{name}", "needs a goal, and there is none", remedy)
        return str(setting[TEMPLATE]) if TEMPLATE in setting else work
    if TEMPLATE in setting:
        raise SpecError("command line", f"--set {TEMPLATE}", "is given beside --goal", "give one of them")
    return _changed(work, GOAL_PREFIX, aimed, PoseGoal.model_fields, "a field of a goal")


def _changed(base: M, prefix: str, values: Mapping[str, Any], known: Collection[str], what: str) -> M:
    """Return the message with these values; `known` are the allowed names, `what` describes the message."""
    for name in sorted(set(values).difference(known)):
        names = ", ".join(f"{prefix}{field}" for field in known)
        raise SpecError("command line", f"--set {prefix}{name}", f"is not {what}", f"use {names}")
    try:
        return type(base).model_validate({**base.model_dump(), **values})
    except ValidationError as error:
        raise problems_of(error, f"--set {prefix.rstrip('.')}", values, type(base)) from error


def _put(fields: dict[str, Any], name: str, place: str, value: Any, owner: str) -> None:
    """Set the field at the dotted `place` to a value; `name` is the setting's own name for it."""
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
