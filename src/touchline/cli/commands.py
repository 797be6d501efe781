"""Entry of the command: its subcommands, and the reporting of errors."""

import io
import logging
import os
import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib import import_module

import typer

from touchline.cli.display import Verbosity
from touchline.cli.groups import in_panel
from touchline.cli.options import ExitCode
from touchline.cli.overview import PANELS, bare
from touchline.cli.settings_file import PREFIX, command_of, defaults_for, settings
from touchline.schemas.errors import MissingExtra, TouchlineError
from touchline.schemas.plain_text import plain_lines
from touchline.schemas.plugin_packages import blamed


def command_line(asked: str | None = None) -> typer.Typer:
    """Return the command with its subcommands.

    Args:
        asked: The subcommand to run: only its module is loaded, since importing all takes longer than most need to
            run. None or an unknown name loads all whose packages are installed.

    Raises:
        MissingExtra: The subcommand needs packages that are not installed.
    """
    app = bare()
    known = asked == "--version" or any(asked in names for modules in PANELS.values() for names in modules.values())
    for panel, modules in PANELS.items():
        for module, names in modules.items():
            if asked in names:
                import_module(f"touchline.cli.{module}").register(app)
            elif not known:
                with suppress(MissingExtra):
                    import_module(f"touchline.cli.{module}").register(app)
            in_panel(app, panel)
    return app


def execute() -> int:
    """Run the command; errors that the user can mend are one line, without a traceback.

    Returns:
        The exit code.

    Raises:
        KeyboardInterrupt: Interrupted before or after the work of a subcommand.
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # where the locale has no ² or ·, print a question mark
    completing = "_TOUCHLINE_COMPLETE" in os.environ
    try:
        with _logging():
            app = command_line(sys.argv[1] if len(sys.argv) > 1 and not completing else None)
            defaults = defaults_for(command_of(app), settings())
            app(default_map=defaults, auto_envvar_prefix=PREFIX)
    except TouchlineError as error:
        return _report(error)
    except Exception as error:
        plugin_error = blamed(error)
        if plugin_error is None:
            raise
        return _report(plugin_error)
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else ExitCode.OK
    return ExitCode.OK


@contextmanager
def _logging() -> Iterator[None]:
    """Show what modules log on standard error: warnings, unless the subcommand's options want more."""
    logger, handler = logging.getLogger("touchline"), logging.StreamHandler()
    handler.setFormatter(_LevelFirst())
    logger.setLevel(logging.WARNING)
    logger.addHandler(handler)
    try:
        yield
    finally:
        logger.removeHandler(handler)


class _LevelFirst(logging.Formatter):
    """Formatter of records like the command's own messages."""

    def format(self, record: logging.LogRecord) -> str:
        """Return level and text, without control sequences; a traceback follows."""
        return f"{record.levelname.lower()}: {plain_lines(super().format(record))}"


def _report(error: TouchlineError) -> int:
    if Verbosity.verbose:
        traceback.print_exc()
    sys.stderr.write(f"error: {plain_lines(str(error))}\n")
    return ExitCode.UNUSABLE
