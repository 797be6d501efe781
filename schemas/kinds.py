"""Parts of a specification whose class depends on the kind that they name."""

from collections.abc import Callable
from typing import Any

from pydantic import ValidationInfo, ValidatorFunctionWrapHandler

from touchline.schemas.misfit import misfit
from touchline.schemas.plugins import Registry, listed, part_for


def of_its_kind(
    registry: Registry[Any], room: str = "spec", usual: str = ""
) -> Callable[[Any, ValidatorFunctionWrapHandler, ValidationInfo], Any]:
    """Return a validator of a part: a dictionary is validated by the class that its kind has for it.

    Args:
        registry: Kinds of such parts.
        room: Name of the class in `KindParts`.
        usual: Kind of a part that names none; without it a part must name its kind.
    """

    def validate(given: Any, handler: ValidatorFunctionWrapHandler, info: ValidationInfo) -> Any:
        if not isinstance(given, dict):
            return handler(given)
        kinds = registry.offered()
        kind = given.get("kind", usual)
        if kind not in kinds:
            remedy = f"give {listed(kinds)}" if kinds else f"install a package that brings a {registry.kind}"
            raise misfit("kind", kind, remedy)
        return part_for(registry, kind, room).model_validate(given, context=info.context)

    return validate
