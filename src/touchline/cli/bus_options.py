"""The options `--identity` and `--open-to-network`, which every subcommand has that joins a bus."""

import inspect
import os
from collections.abc import Callable
from functools import wraps
from typing import Annotated, Any

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
        "--open-to-network", help="Allow an open bus that other machines can reach: anybody there commands the robots."
    ),
]


def with_bus_options(command: Callable[..., None]) -> Callable[..., None]:
    """Return the command with both options behind its own; processes that it starts go by them, too."""
    shown = inspect.signature(command, eval_str=True).parameters.values()
    own = [parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY) for parameter in shown]
    added = [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=option)
        for name, default, option in (("identity", None, _IDENTITY), ("open_to_network", False, _OPEN))
    ]

    @wraps(command)
    def joining(*, identity: str | None, open_to_network: bool, **values: Any) -> None:
        if identity is not None:
            os.environ[IDENTITY_VARIABLE] = identity
        if open_to_network:
            os.environ[OPEN_VARIABLE] = "1"
        command(**values)

    joining.__signature__ = inspect.Signature([*own, *added])  # type: ignore[attr-defined]
    joining.__annotations__ = {parameter.name: parameter.annotation for parameter in (*own, *added)}
    return joining
