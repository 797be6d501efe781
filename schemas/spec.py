"""Reading JSON specifications into models, with errors that name the file, the field and the remedy."""

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self, TypeVar

from pydantic import (
    BaseModel,
    ConfigDict,
    SerializationInfo,
    SerializerFunctionWrapHandler,
    ValidationError,
    model_serializer,
)

from touchline.schemas.errors import SpecError
from touchline.schemas.near_names import did_you_mean, field_names
from touchline.schemas.plain_text import plain
from touchline.schemas.remedies import told

if TYPE_CHECKING:
    from pydantic_core import ErrorDetails

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

    def replace(self, field: str, value: Any, /) -> Self:
        """Copy with one field changed, and checked as a file would be.

        Args:
            field: Dotted name, such as ``drive.track_width_m``; indices of lists are numbers.
            value: Its new value, as in JSON or as an object.

        Raises:
            SpecError: There is no such field, or the value is not allowed.
        """
        source, given = type(self).__name__, self.model_dump(mode="json", context=EVERY_FIELD)
        *way, last = [int(part) if part.isdigit() else part for part in field.split(".")]
        inside: Any = given
        try:
            for part in way:
                inside = inside[part]
            inside[last]
        except (LookupError, TypeError) as error:
            known = inside if isinstance(inside, dict) else range(len(inside)) if isinstance(inside, list) else ()
            names = ", ".join(map(str, known))
            raise SpecError(
                source, field, "is not a field", f"use one of: {names}" if names else "shorten it"
            ) from error
        inside[last] = value.model_dump(mode="json", context=EVERY_FIELD) if isinstance(value, BaseModel) else value
        return parse(type(self), json.dumps(given), source)


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
        with path.open("rb") as file:
            data = file.read(MAX_SPEC_BYTES + 1)  # a pipe or a device does not tell its size
        if len(data) > MAX_SPEC_BYTES:
            raise SpecError(path.name, "", f"has more than {MAX_SPEC_BYTES:,} bytes", "give a smaller file")
        return data.decode("utf-8-sig")  # some editors begin a file with a mark
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
        raise problems_of(error, source, data, kind) from error


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


_LONGEST_PROBLEM = 80
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
    """Shortest object of that class: ``an object {"corners": …}``."""
    kinds = list(Spec.__subclasses__())
    for kind in kinds:
        kinds += kind.__subclasses__()
        if kind.__name__ == class_name:
            required = [f'"{name}": …' for name, field in kind.model_fields.items() if field.is_required()]
            return f"an object {{{', '.join(required)}}}"
    return "an object"


def problems_of(error: ValidationError, source: str, data: Any, kind: type[BaseModel] | None = None) -> SpecError:
    """All problems of validating ``data``, each with field and remedy.

    Args:
        error: Of the validation.
        source: File name or other origin of the data.
        data: As given to the validation.
        kind: The model that it was validated as, for suggestions of the fields that it has.
    """
    first, *others = (_Problem(found, data, kind) for found in error.errors())
    return SpecError(source, first.field, first.problem, first.remedy, [other.line() for other in others])


class _Problem:
    """One problem of a validation, in the words of the data's author."""

    def __init__(self, found: "ErrorDetails", data: Any, kind: type[BaseModel] | None) -> None:
        self.field = field_path(_without_tags(found["loc"], data, found["type"] in _LEFT_OUT))
        self.problem, self.remedy = self._told(found, kind)
        if len(self.problem) >= _LONGEST_PROBLEM:
            self.problem = "is not allowed"

    def line(self) -> str:
        """The problem as a line below that of the first."""
        return f"{self.field} {self.problem}; {self.remedy}" if self.field else f"{self.problem}; {self.remedy}"

    def _told(self, found: "ErrorDetails", kind: type[BaseModel] | None) -> tuple[str, str]:
        given, context = found["input"], found.get("ctx", {})
        if found["type"] == "missing":
            return "is missing", "add it"
        if found["type"] == "extra_forbidden":
            *place, name = found["loc"]
            near = did_you_mean(str(name), field_names(kind, tuple(place))) if kind else ""
            return "is not a known field", near or "remove it or mend its name"
        if found["type"] == "model_type":
            return f"is a JSON {_json_name(given)}", f"give {_form(context['class_name'])}"
        if isinstance(given, float) and not math.isfinite(given):
            return f"is {given}", "give a finite number"
        if found["type"].startswith("union_tag_"):
            return self._of_tag(found["type"], context)
        if words := told(found["type"], found["loc"], given, context):
            return words
        message = found["msg"].removeprefix("Value error, ")
        simple = isinstance(given, str | int | float | bool) or given is None
        return f"is {given!r}" if simple else "is not allowed", message

    def _of_tag(self, kind: str, context: dict[str, Any]) -> tuple[str, str]:
        name = context["discriminator"].strip("'")
        self.field = f"{self.field}.{name}" if self.field else name
        if kind == "union_tag_not_found":
            return "is missing", "add it"
        tags = context["expected_tags"].replace("'", "")
        near = did_you_mean(str(context["tag"]), tags.split(", "))
        return f"is {context['tag']!r}", f"give one of {tags}{'; ' if near else ''}{near}"
