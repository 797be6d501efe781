"""Subject of a sweep: a template, or a goal to drive to."""

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final

import typer

from touchline.cli.choices import PlanChoice
from touchline.cli.number_list import numbers_of
from touchline.schemas.catalogue import shipped_templates
from touchline.schemas.errors import SpecError
from touchline.schemas.given_angles import given_angle
from touchline.schemas.messages import PlanOptions, PoseGoal
from touchline.schemas.scenario import Scenario
from touchline.schemas.spec import parse, read_text

_BESIDE_GOAL: Final = "give one of them: a robot works on a template or drives to a goal"


@dataclass(frozen=True)
class SubjectChoice:
    """Subject and world of a sweep."""

    subject: Annotated[
        str | None,
        typer.Argument(
            metavar="SCENARIO|TEMPLATE",
            help="A shipped template's name, a template file or a scenario file. With --goal: a "
            "scenario file, or nothing.",
        ),
    ] = None
    template: Annotated[
        str | None, typer.Option(metavar="TEMPLATE", help="Template, if a scenario file is given (default: soccer-11).")
    ] = None
    goal: Annotated[
        str | None,
        typer.Option(
            metavar="X,Y[,HEADING]",
            help="Drive to this pose (m, m, rad; default heading: any) instead of working on a template, from the "
            "scenario's start, or 0,0,0; `--set goal.method=…` and the like say how.",
        ),
    ] = None

    def chosen(self) -> tuple[str | PoseGoal, PlanOptions, Scenario]:
        """Return the subject, the planning options and the world.

        Raises:
            SpecError: The subject is missing, ambiguous or cannot be read.
        """
        template, scenario = _parsed_subject(self.subject) if self.subject is not None else (None, Scenario())
        if self.goal is not None:
            for named in (template, self.template):
                if named is not None:
                    problem = f"is {self.goal}, and the template {named} is given, too"
                    raise SpecError("command line", "--goal", problem, _BESIDE_GOAL)
            example = "3,2,1.2, or 3,2 for any heading"
            x_m, y_m, *given = numbers_of("--goal", self.goal, (2, 3), example)
            heading_rad = given_angle("--goal", given[0]) if given else math.nan
            goal = PoseGoal(x_m=x_m, y_m=y_m, heading_rad=heading_rad)
            return goal, PlanOptions(), scenario.model_copy(update={"start": scenario.standing()})
        if self.subject is None:
            remedy = "give a template, a scenario file, or --goal X,Y[,HEADING]"
            raise SpecError("command line", "SCENARIO|TEMPLATE", "is missing", remedy)
        return template or self.template or "soccer-11", PlanChoice().options(), scenario


def _parsed_subject(subject: str) -> tuple[str | None, Scenario]:
    """Return (template, scenario) of the first argument, which names one of them."""
    if subject in shipped_templates():
        return subject, Scenario()
    path = Path(subject)
    if not path.exists():
        names = ", ".join(shipped_templates())
        raise SpecError(subject, "", "is no scenario file, template file or shipped template", f"use one of: {names}")
    text = read_text(path)
    try:
        content = json.loads(text)
    except ValueError:
        content = None
    if isinstance(content, dict) and ("segments" in content or "areas" in content):
        return subject, Scenario()
    return None, parse(Scenario, text, path.name)
