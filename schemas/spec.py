"""Reading JSON specifications into models, with errors that name the file, the field and the remedy."""

import json
import math
from pathlib import Path
from typing import Any, ClassVar, TypeVar

from pydantic import (
    BaseModel,
    ConfigDict,
    SerializationInfo,
    SerializerFunctionWrapHandler,
    ValidationError,
    model_serializer,
)

from touchline.schemas.errors import SpecError
from touchline.schemas.plain_text import plain
from touchline.schemas.remedies import told

S = TypeVar("S", bound=BaseModel)

#: A specification is read whole; anything larger is not one.
MAX_SPEC_BYTES = 16 * 1024 * 1024
#: Keys of one object; none of ours has a tenth of that.
MAX_KEYS = 1000
#: Context of a dump for people: with it, what is left out of recordings where it is as by default is written, too.
EVERY_FIELD = {"every_field": True}


class Spec(BaseModel):
    """Base of every specification: frozen, finite numbers only, no unknown fields."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class GrownSpec(Spec):
    """A specification that has got further fields, of which those with their default value are not written.

    What says nothing of them is thus written to the same bytes as before there were any, and hashes stay.
    """

    later_fields: ClassVar[tuple[str, ...]] = ()

    @model_serializer(mode="wrap")
    def _as_before(self, handler: SerializerFunctionWrapHandler, info: SerializationInfo) -> dict[str, Any]:
        written: dict[str, Any] = handler(self)
        for name in self.later_fields if info.context != EVERY_FIELD else ():
            if getattr(self, name) == type(self).model_fields[name].default:
                written.pop(name, None)
        return written


def read_text(path: Path) -> str:
    """The text of a specification file.

    Raises:
        SpecError: It cannot be read, is too large, or is not UTF-8.
    """
    try:
        if path.stat().st_size > MAX_SPEC_BYTES:
            raise SpecError(path.name, "", f"has {path.stat().st_size:,} bytes", f"give at most {MAX_SPEC_BYTES:,}")
        return path.read_text(encoding="utf-8-sig")  # some editors begin a file with a mark
    except OSError as error:
        raise SpecError(
            str(path), "", f"cannot be read ({error.strerror})", "give the path of a readable file"
        ) from error
    except UnicodeDecodeError as error:
        raise SpecError(path.name, "", "is not UTF-8 text", "save it as UTF-8 JSON") from error


def parse(kind: type[S], text: str, source: str, *, recorded: bool = False) -> S:
    """The ``kind`` written in ``text``; of a ``recorded`` one the texts are taken as they are.

    Raises:
        SpecError: It is not JSON, too large, or a field is missing, unknown, or out of range.
    """
    if len(text) > MAX_SPEC_BYTES:
        raise SpecError(source, "", f"has {len(text):,} characters", f"give at most {MAX_SPEC_BYTES:,}")
    try:
        data = json.loads(text, object_pairs_hook=_unique_keys)
    except RecursionError as error:
        raise SpecError(source, "", "is nested too deeply", "give a flat JSON object") from error
    except json.JSONDecodeError as error:
        place = f"line {error.lineno}, column {error.colno}"
        raise SpecError(source, place, f"is not JSON ({error.msg})", "mend the JSON there") from error
    except _RepeatedKey as error:
        raise SpecError(source, "", f"is not usable JSON ({error})", "name every key once") from error
    except _TooManyKeys as error:
        raise SpecError(source, "", str(error), f"give at most {MAX_KEYS:,}") from error
    except ValueError as error:  # of the interpreter's own limit
        raise SpecError(source, "", "has a number of thousands of digits", "give a number within range") from error
    if not isinstance(data, dict):
        raise SpecError(source, "", f"is a JSON {_json_name(data)}", "give a JSON object")
    try:
        return kind.model_validate(data, context={"recorded": recorded})
    except ValidationError as error:
        raise first_problem(error, source, data) from error


class _RepeatedKey(ValueError):
    """An object names a key twice."""


class _TooManyKeys(ValueError):
    """An object that cannot be one of ours."""


def _unique_keys(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for key, value in pairs:
        if key in found:
            raise _RepeatedKey(f"key {plain(key, 80)!r} is given twice")
        found[key] = value
    if len(found) > MAX_KEYS:
        raise _TooManyKeys(f"has an object of {len(found):,} keys")
    return found


def field_path(location: tuple[int | str, ...]) -> str:
    """``("segments", 3, "arc")`` as ``segments[3].arc``."""
    path = ""
    for part in location:
        path += f"[{part}]" if isinstance(part, int) else f".{part}" if path else str(part)
    return path


# Problems of a field that may have been left out.
_LEFT_OUT = ("missing", "misfit")


def _without_tags(location: tuple[int | str, ...], data: Any, left_out: bool) -> tuple[int | str, ...]:
    """A pydantic location less the tags of tagged unions, which the author of the text has never seen."""
    kept: list[int | str] = []
    for index, part in enumerate(location):
        known = index == 0 or (left_out and index == len(location) - 1)  # a field, perhaps one left at its default
        if isinstance(data, dict) and part not in data and not known:
            continue
        kept.append(part)
        if isinstance(data, dict):
            data = data.get(part)
        elif isinstance(data, list) and isinstance(part, int) and part < len(data):
            data = data[part]
    return tuple(kept)


_JSON_NAMES = {list: "array", str: "string", int: "number", float: "number", bool: "boolean", type(None): "null"}


def _json_name(value: object) -> str:
    return _JSON_NAMES.get(type(value), "value")


def _form(class_name: str) -> str:
    """What an object of that class must have at least: ``an object {"corners": …}``."""
    kinds = list(Spec.__subclasses__())
    for kind in kinds:
        kinds += kind.__subclasses__()
        if kind.__name__ == class_name:
            required = [f'"{name}": …' for name, field in kind.model_fields.items() if field.is_required()]
            return f"an object {{{', '.join(required)}}}"
    return "an object"


def first_problem(error: ValidationError, source: str, data: Any) -> SpecError:
    """The first of the problems of validating ``data``, told by ``source``, field and remedy."""
    problems = error.errors()
    first = problems[0]
    others = f" (and {len(problems) - 1} more)" if len(problems) > 1 else ""
    field = field_path(_without_tags(first["loc"], data, first["type"] in _LEFT_OUT))
    given = first["input"]
    if first["type"] == "missing":
        return SpecError(source, field, "is missing", f"add it{others}")
    if first["type"] == "extra_forbidden":
        return SpecError(source, field, "is not a known field", f"remove it or mend its name{others}")
    if first["type"] == "model_type":
        form = _form(first["ctx"]["class_name"])
        return SpecError(source, field, f"is a JSON {_json_name(given)}", f"give {form}{others}")
    if isinstance(given, float) and not math.isfinite(given):
        return SpecError(source, field, f"is {given}", f"give a finite number{others}")
    if first["type"].startswith("union_tag_"):
        name = first["ctx"]["discriminator"].strip("'")
        field = f"{field}.{name}" if field else name
        if first["type"] == "union_tag_not_found":
            return SpecError(source, field, "is missing", f"add it{others}")
        tags = first["ctx"]["expected_tags"].replace("'", "")
        return SpecError(source, field, f"is {first['ctx']['tag']!r}", f"give one of {tags}{others}")
    if found := told(first["type"], first["loc"], given, first.get("ctx", {})):
        problem, remedy = found
        return SpecError(source, field, problem if len(problem) < 80 else "is not allowed", f"{remedy}{others}")
    message = first["msg"].removeprefix("Value error, ")
    shown = f"is {given!r}" if isinstance(given, str | int | float | bool) or given is None else "is not allowed"
    return SpecError(source, field, shown if len(shown) < 80 else "is not allowed", f"{message}{others}")
