"""The fields that Touchline knows: each sport a small file with its parameters, their ranges, and its drawing."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import ValidationError

from touchline.schemas.errors import SpecError
from touchline.schemas.fields.american_football import AmericanFootball, american_football
from touchline.schemas.fields.athletics import AthleticsTrack, athletics_track
from touchline.schemas.fields.baseball import Baseball, baseball
from touchline.schemas.fields.basketball import Basketball, basketball
from touchline.schemas.fields.field_hockey import FieldHockey, field_hockey
from touchline.schemas.fields.lacrosse import Lacrosse, lacrosse
from touchline.schemas.fields.rugby import RugbyUnion, rugby_union
from touchline.schemas.fields.salt_pan import SaltPan, SaltPanL, SaltPanPond, salt_pan, salt_pan_l, salt_pan_pond
from touchline.schemas.fields.sheet import Parameters
from touchline.schemas.fields.soccer import (
    Soccer7,
    Soccer9,
    Soccer11,
    Soccer11Grass,
    soccer_7,
    soccer_9,
    soccer_11,
    soccer_11_grass,
)
from touchline.schemas.fields.square import Square, study_square
from touchline.schemas.fields.tennis import Tennis, tennis
from touchline.schemas.template import Template


@dataclass(frozen=True)
class Parameter:
    """One parameter as a person sees it; ``least`` and ``most`` are None for a switch."""

    name: str
    description: str
    default: float | bool
    least: float | None
    most: float | None

    @property
    def allowed(self) -> str:
        """``"90 to 120"``, or ``"true or false"``."""
        return "true or false" if self.least is None else f"{self.least:g} to {self.most:g}"


@dataclass(frozen=True)
class Field:
    """A kind of field: how it is drawn from its parameters."""

    name: str
    kind: type[Parameters]
    draw: Callable[[Any], Template]

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Parameters that can be set, in order."""
        described = self.kind.model_json_schema().get("properties", {})
        return tuple(
            Parameter(name, each["description"], each["default"], each.get("minimum"), each.get("maximum"))
            for name, each in described.items()
        )

    def template(self, values: Mapping[str, float | bool | str] | None = None) -> Template:
        """The field with these parameters, the others at their defaults; texts are read as numbers and switches.

        Raises:
            SpecError: A parameter is unknown or out of its range, which the error gives.
        """
        try:
            chosen = self.kind.model_validate(dict(values or {}))
        except ValidationError as error:
            raise self._refusal(error) from error
        return self.draw(chosen)

    def _refusal(self, error: ValidationError) -> SpecError:
        first = error.errors()[0]
        name = str(first["loc"][0]) if first["loc"] else ""
        known = {each.name: each for each in self.parameters}
        if not name:
            return SpecError(self.name, "", "is not allowed", first["msg"].removeprefix("Value error, "))
        if name not in known:
            names = f"use one of: {', '.join(known)}" if known else f"{self.name} has none"
            return SpecError(self.name, name, "is not a parameter", names)
        found = known[name]
        return SpecError(self.name, name, f"is {first['input']!r}", f"give {found.allowed} ({found.description})")


FIELDS: dict[str, Field] = {
    name: Field(name, kind, draw)
    for name, kind, draw in (
        ("american-football", AmericanFootball, american_football),
        ("athletics-400", AthleticsTrack, athletics_track),
        ("baseball-infield", Baseball, baseball),
        ("basketball", Basketball, basketball),
        ("field-hockey", FieldHockey, field_hockey),
        ("lacrosse", Lacrosse, lacrosse),
        ("rugby-union", RugbyUnion, rugby_union),
        ("salt-pan", SaltPan, salt_pan),
        ("salt-pan-l", SaltPanL, salt_pan_l),
        ("salt-pan-pond", SaltPanPond, salt_pan_pond),
        ("soccer-11", Soccer11, soccer_11),
        ("soccer-11-grass", Soccer11Grass, soccer_11_grass),
        ("soccer-7", Soccer7, soccer_7),
        ("soccer-9", Soccer9, soccer_9),
        ("study-square", Square, study_square),
        ("tennis", Tennis, tennis),
    )
}
