"""Validation errors for figures that are possible one by one, but not together."""

from typing import Any

from pydantic import ValidationError
from pydantic_core import InitErrorDetails, PydanticCustomError


def misfit(field: str, given: Any, remedy: str) -> ValidationError:
    """Error that a validator of a model raises about one of its fields.

    Args:
        field: Its name.
        given: Its value.
        remedy: What to give instead: ``"give at most 2 m/s: the wheels do no more"``.
    """
    problem = PydanticCustomError("misfit", "{remedy}", {"remedy": remedy})
    return ValidationError.from_exception_data(field, [InitErrorDetails(type=problem, loc=(field,), input=given)])
