"""The options `--quiet` and `--verbose`, which every subcommand has."""

import logging
import os
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Final

import typer

from touchline.cli.added_options import AddedOption, with_options
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

_OPTIONS: Final = (AddedOption("quiet", False, _QUIET), AddedOption("verbose", 0, _VERBOSE))
_LEVELS: Final = (logging.WARNING, logging.INFO, logging.DEBUG)


def with_verbosity(command: Callable[..., None]) -> Callable[..., None]:
    """Return the command with both options behind its own."""

    def louder(*, quiet: bool, verbose: int, **values: Any) -> None:
        Verbosity.quiet, Verbosity.verbose = quiet, verbose
        if verbose:
            os.environ[VERBOSE] = str(verbose)
        wanted = os.environ.get(VERBOSE, "0")  # by those who started this process, too
        logging.getLogger("touchline").setLevel(_LEVELS[min(int(wanted), 2) if wanted.isdigit() else 1])
        Verbosity.output_taken = STANDARD_OUTPUT in (value for value in values.values() if isinstance(value, Path))
        command(**values)

    return with_options(command, _OPTIONS, louder)
