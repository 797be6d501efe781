"""Options added to a subcommand behind its own."""

import inspect
from collections.abc import Callable, Sequence
from functools import wraps
from typing import Any, NamedTuple


class AddedOption(NamedTuple):
    """Option that a subcommand's function does not know.

    Attributes:
        name: Name of the parameter.
        default: Its default.
        annotation: Its type, with Typer's option.
    """

    name: str
    default: Any
    annotation: Any


def with_options(
    command: Callable[..., None], options: Sequence[AddedOption], run: Callable[..., None]
) -> Callable[..., None]:
    """Return a command with further options, for Typer.

    Args:
        command: The command.
        options: The further options.
        run: Called in its place, with all values by name.
    """
    shown = inspect.signature(command, eval_str=True).parameters.values()
    own = [parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY) for parameter in shown]
    added = [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation)
        for name, default, annotation in options
    ]
    wrapper = wraps(command)(run)
    wrapper.__signature__ = inspect.Signature([*own, *added])  # type: ignore[attr-defined]
    wrapper.__annotations__ = {parameter.name: parameter.annotation for parameter in (*own, *added)}
    return wrapper
