"""The options `--identity`, of subcommands that join a bus, and `--open-to-network`, of all that use a network."""

import inspect
import os
from collections.abc import Callable
from functools import wraps
from typing import Annotated, Any, Final

import typer

from touchline.schemas.bus_variables import IDENTITY_VARIABLE, OPEN_VARIABLE

_IDENTITY = Annotated[
    str | None,
    typer.Option(
        "--identity",
        metavar="NAME",
        help="Who this is on a secured bus, by `touchline keys list`, or a folder (default: $TOUCHLINE_IDENTITY).",
    ),
]
_OPEN = Annotated[
    bool,
    typer.Option(
        "--open-to-network",
        help="Allow open endpoints that other machines can reach: anybody there commands robots, or Dask's workers.",
    ),
]
_OPEN_OPTION: Final = ("open_to_network", False, _OPEN)
_BUS_OPTIONS: Final = (("identity", None, _IDENTITY), _OPEN_OPTION)


def with_bus_options(command: Callable[..., None]) -> Callable[..., None]:
    """Return the command with both options behind its own; processes that it starts go by them, too."""
    return _with_options(command, _BUS_OPTIONS)


def with_network_option(command: Callable[..., None]) -> Callable[..., None]:
    """Return the command with `--open-to-network` behind its own options."""
    return _with_options(command, (_OPEN_OPTION,))


def _with_options(command: Callable[..., None], options: tuple[tuple[str, Any, Any], ...]) -> Callable[..., None]:
    shown = inspect.signature(command, eval_str=True).parameters.values()
    own = [parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY) for parameter in shown]
    added = [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=option)
        for name, default, option in options
    ]

    @wraps(command)
    def joining(*, open_to_network: bool, identity: str | None = None, **values: Any) -> None:
        if identity is not None:
            os.environ[IDENTITY_VARIABLE] = identity
        if open_to_network:
            os.environ[OPEN_VARIABLE] = "1"
        command(**values)

    joining.__signature__ = inspect.Signature([*own, *added])  # type: ignore[attr-defined]
    joining.__annotations__ = {parameter.name: parameter.annotation for parameter in (*own, *added)}
    return joining
