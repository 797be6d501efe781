"""The options `--identity`, of subcommands that join a bus, and `--open-to-network`, of all that use a network."""

import os
from collections.abc import Callable, Sequence
from typing import Annotated, Any, Final

import typer

from touchline.cli.added_options import AddedOption, with_options
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
_OPEN_OPTION: Final = AddedOption("open_to_network", False, _OPEN)
_BUS_OPTIONS: Final = (AddedOption("identity", None, _IDENTITY), _OPEN_OPTION)


def with_bus_options(command: Callable[..., None]) -> Callable[..., None]:
    """Return the command with both options behind its own; processes that it starts go by them, too."""
    return _with(command, _BUS_OPTIONS)


def with_network_option(command: Callable[..., None]) -> Callable[..., None]:
    """Return the command with `--open-to-network` behind its own options."""
    return _with(command, (_OPEN_OPTION,))


def _with(command: Callable[..., None], options: Sequence[AddedOption]) -> Callable[..., None]:
    def joining(*, open_to_network: bool, identity: str | None = None, **values: Any) -> None:
        if identity is not None:
            os.environ[IDENTITY_VARIABLE] = identity
        if open_to_network:
            os.environ[OPEN_VARIABLE] = "1"
        command(**values)

    return with_options(command, options, joining)
