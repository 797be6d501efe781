"""The options `--quiet` and `--verbose`, which every subcommand has."""

import inspect
import os
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Annotated, Any

import typer

from touchline.cli.display import Verbosity
from touchline.recordings.writing import STANDARD_OUTPUT
from touchline.schemas.plugins import VERBOSE

_QUIET = Annotated[bool, typer.Option("--quiet", "-q", help="Show results, warnings and errors only.")]
_VERBOSE = Annotated[bool, typer.Option("--verbose", "-v", help="Show the traceback of an error, too.")]


def with_verbosity(command: Callable[..., None]) -> Callable[..., None]:
    """Return the command with both options behind its own."""
    shown = inspect.signature(command, eval_str=True).parameters.values()
    own = [parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY) for parameter in shown]
    added = [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=False, annotation=option)
        for name, option in (("quiet", _QUIET), ("verbose", _VERBOSE))
    ]

    @wraps(command)
    def louder(*, quiet: bool, verbose: bool, **values: Any) -> None:
        Verbosity.quiet, Verbosity.verbose = quiet, verbose
        if verbose:
            os.environ[VERBOSE] = "1"
        Verbosity.output_taken = STANDARD_OUTPUT in (value for value in values.values() if isinstance(value, Path))
        command(**values)

    louder.__signature__ = inspect.Signature([*own, *added])  # type: ignore[attr-defined]
    louder.__annotations__ = {parameter.name: parameter.annotation for parameter in (*own, *added)}
    return louder
