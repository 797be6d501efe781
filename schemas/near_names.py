"""Suggestions for a name that is not known: the known one that was probably meant."""

from collections.abc import Iterable, Iterator
from difflib import get_close_matches
from typing import Any, get_args

from pydantic import BaseModel

_CUTOFF = 0.6


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """A question to put into a remedy, `did you mean 'speed_mps'?`; empty if nothing known is near."""
    near = get_close_matches(name.lower(), known, n=1, cutoff=_CUTOFF)
    return f"did you mean {near[0]!r}?" if near else ""


def field_names(kind: type[BaseModel], location: tuple[int | str, ...]) -> set[str]:
    """The fields of the object at a location of pydantic's in a model of that kind; those of all members of a union."""
    models = {kind}
    for part in location:
        entered = {
            inner
            for model in models
            if part in model.model_fields
            for inner in _models_in(model.model_fields[str(part)].annotation)
        }
        models = entered or models  # an index, or the tag of a union, leads no further
    return {name for model in models for name in model.model_fields}


def _models_in(annotation: Any) -> Iterator[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
        for kind in annotation.__subclasses__():  # of a drive or a tool, say
            yield from _models_in(kind)
    for inner in get_args(annotation):
        yield from _models_in(inner)
