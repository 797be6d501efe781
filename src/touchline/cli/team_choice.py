"""Options of a team and its task."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from touchline.cli.choices import VehicleChoice, VehicleOption
from touchline.coordination.algorithms.algorithm_loading import absolute
from touchline.schemas.errors import SpecError
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.scenario import MAX_SEED, Noise, Scenario
from touchline.schemas.spec import EVERY_FIELD, parse, read_text
from touchline.schemas.team import LOSSY_LEASE_S, MOST_ROBOTS, TeamScenario
from touchline.schemas.vehicles.shipped import on_its_ground, with_its_own

Avoid = Literal["cells", "plans", "barriers", "none"]
Heading = Literal["bearing", "free"]


@dataclass(frozen=True)
class TeamChoice:
    """A team: a file, and options that override it."""

    team: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="JSON file of a team (docs/reference/teams.md); options override it."),
    ] = None
    task: Annotated[
        str | None, typer.Option(metavar="KIND", help="Task: deploy (default) or swap; others in a --team file.")
    ] = None
    algorithm: Annotated[
        str | None,
        typer.Option(metavar="NAME|FILE.py:NAME", help="Algorithm that decides where robots drive (default: by task)."),
    ] = None
    vehicle: VehicleOption = None
    noise: Annotated[
        Noise | None, typer.Option(metavar="NOISE", help="Sensor and actuator noise: default or none.")
    ] = None
    avoid: Annotated[
        Avoid | None,
        typer.Option(metavar="HOW", help="Collision avoidance: cells (default), plans, barriers, or none."),
    ] = None
    path: Annotated[
        Heading | None,
        typer.Option(metavar="HEADING", help="With --avoid none: headings at goals, bearing (default) or free."),
    ] = None
    loss: Annotated[float | None, typer.Option(metavar="SHARE", help="Share of messages lost, 0 to 0.95.")] = None
    delay: Annotated[float | None, typer.Option(metavar="S", help="Largest delay of messages, s, 0 to 5.")] = None
    duration: Annotated[float | None, typer.Option(metavar="S", help="Duration in sim time, s (default: 120).")] = None

    def chosen(self, robots: int | None = None, seed: int | None = None) -> TeamScenario:
        """Return the file's team, or the default one, with the options applied.

        Args:
            robots: Number of robots, if given.
            seed: Seed of the noise, if given.

        Raises:
            SpecError: The file is not usable, or an option contradicts it.
        """
        text = read_text(self.team) if self.team else "{}"
        team = parse(TeamScenario, text, self.team.name if self.team else "command line")
        fields: dict[str, Any] = team.model_dump(mode="json", context=EVERY_FIELD)
        if robots is not None:
            if team.places and robots != len(team.places):
                problem = f"is {robots}, but {self.team} has places of {len(team.places)}"
                raise SpecError("command line", "--robots", problem, "give one of them")
            fields["robots"] = robots
        if self.vehicle is not None:
            fields |= _with_vehicle(team, self.vehicle)
        if self.task is not None:
            if self.task not in ("deploy", "swap"):
                problem = f"is {self.task!r}"
                raise SpecError("command line", "--task", problem, "give deploy or swap, or a task in a --team file")
            fields["task"] = {"kind": self.task}
        if self.algorithm is not None:
            options = {} if team.algorithm is None else team.algorithm.options
            fields["algorithm"] = {"use": absolute(self.algorithm), "options": options}
        for name, value in {"avoid": self.avoid, "path": self.path, "duration_s": self.duration}.items():
            if value is not None:
                fields[name] = value
        for name, value in {"loss": self.loss, "delay_s": self.delay}.items():
            if value is not None:
                fields["links"][name] = value
        if (self.loss or self.delay) and "onboard" not in team.model_fields_set:
            fields["onboard"]["team"]["lease_s"] = LOSSY_LEASE_S
        for name, given in {"seed": seed, "noise": self.noise}.items():
            if given is not None:
                fields["world"][name] = given
        return _parsed(fields)


def _with_vehicle(team: TeamScenario, chosen: Path) -> dict[str, Any]:
    """Return the vehicle, with its own ground and computer where the team has none."""
    given, name = team.model_fields_set, str(chosen)
    found: dict[str, Any] = {"vehicle": VehicleChoice(chosen).chosen().model_dump(mode="json")}
    if "onboard" not in given:
        found["onboard"] = with_its_own(name, OnboardConfig()).model_dump(mode="json", context=EVERY_FIELD)
    if "world" not in given:
        found["world"] = on_its_ground(name, Scenario()).model_dump(mode="json", context=EVERY_FIELD)
    return found


def _parsed(fields: dict[str, Any]) -> TeamScenario:
    import json

    return parse(TeamScenario, json.dumps(fields), "team")


RobotsCountOption = Annotated[
    int | None, typer.Option("--robots", metavar="N", help="Number of robots (default: 10).", min=1, max=MOST_ROBOTS)
]
SeedOption = Annotated[
    int | None, typer.Option("--seed", metavar="N", help="Seed of all noise and of the starts.", min=0, max=MAX_SEED)
]
