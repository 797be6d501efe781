"""The options `--quiet` and `--verbose`, which every subcommand has."""

import inspect
import logging
import os
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Annotated, Any, Final

import typer

from touchline.cli.display import Verbosity
from touchline.recordings.writing import STANDARD_OUTPUT
from touchline.schemas.plugins import VERBOSE

_QUIET = Annotated[bool, typer.Option("--quiet", "-q", help="Show results, warnings and errors only.")]
_VERBOSE = Annotated[
    int,
    typer.Option(
        "--verbose", "-v", count=True, show_default=False, help="Show more: tracebacks and the log; -vv: all of it."
    ),
]

_LEVELS: Final = (logging.WARNING, logging.INFO, logging.DEBUG)


def with_verbosity(command: Callable[..., None]) -> Callable[..., None]:
    """Return the command with both options behind its own."""
    shown = inspect.signature(command, eval_str=True).parameters.values()
    own = [parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY) for parameter in shown]
    added = [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=option)
        for name, default, option in (("quiet", False, _QUIET), ("verbose", 0, _VERBOSE))
    ]

    @wraps(command)
    def louder(*, quiet: bool, verbose: int, **values: Any) -> None:
        Verbosity.quiet, Verbosity.verbose = quiet, verbose
        if verbose:
            os.environ[VERBOSE] = str(verbose)
        wanted = os.environ.get(VERBOSE, "0")  # by those who started this process, too
        logging.getLogger("touchline").setLevel(_LEVELS[min(int(wanted), 2) if wanted.isdigit() else 1])
        Verbosity.output_taken = STANDARD_OUTPUT in (value for value in values.values() if isinstance(value, Path))
        command(**values)

    louder.__signature__ = inspect.Signature([*own, *added])  # type: ignore[attr-defined]
    louder.__annotations__ = {parameter.name: parameter.annotation for parameter in (*own, *added)}
    return louder
