"""Setup that a journal was kept with, and its differences to another one."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from typing import Any, Final, NamedTuple, Self

from touchline.schemas.setup import Setup
from touchline.schemas.spec import field_path

_SHOWN: Final = 3
"""Number of differences that are listed."""
_LONGEST: Final = 40
"""Characters of a value that are shown."""
_ABSENT: Final = object()


class SetupText(NamedTuple):
    """A setup as canonical JSON. A scenario's name has no effect, so it is left out."""

    text: str

    @classmethod
    def of(cls, setup: Setup) -> Self:
        """Write the setup of a robot."""
        scenario = setup.scenario.model_dump(mode="json", exclude={"name"})
        robot = {name: getattr(setup, name).model_dump(mode="json") for name in ("vehicle", "onboard")}
        return cls(json.dumps({**robot, **scenario}, sort_keys=True, separators=(",", ":")))

    @property
    def digest(self) -> bytes:
        """Digest of the setup, 16 bytes."""
        return hashlib.blake2b(self.text.encode(), digest_size=16).digest()

    def changes_from(self, earlier: SetupText) -> str:
        """List the differences to an earlier setup, for people: ``ground.surface was "grass", is "wet-grass"``."""
        found = list(_changes(json.loads(earlier.text), json.loads(self.text), ()))
        more = f" (and {len(found) - _SHOWN} more)" if len(found) > _SHOWN else ""
        return "; ".join(found[:_SHOWN]) + more


def _changes(then: Any, now: Any, place: tuple[int | str, ...]) -> Iterator[str]:
    if then == now:
        return
    if isinstance(then, dict) and isinstance(now, dict):
        for name in sorted(then.keys() | now.keys()):
            yield from _changes(then.get(name, _ABSENT), now.get(name, _ABSENT), (*place, name))
    elif isinstance(then, list) and isinstance(now, list) and len(then) == len(now):
        for index, pair in enumerate(zip(then, now, strict=True)):
            yield from _changes(*pair, (*place, index))
    else:
        yield f"{field_path(place)} was {_shown(then)}, is {_shown(now)}"


def _shown(value: object) -> str:
    if value is _ABSENT:
        return "not there"
    text = json.dumps(value, ensure_ascii=False)
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 1]}…"
