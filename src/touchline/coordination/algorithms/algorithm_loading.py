"""Algorithms by their name or file."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from touchline.schemas.errors import SpecError
from touchline.schemas.plugins import TEAM_ALGORITHMS
from touchline.schemas.team import AlgorithmChoice

Make = Callable[[], Any]

EXTERNAL: Final = "external"
"""Algorithm of other processes, asked over the bus."""
_IN_FILE: Final = ".py:"


def algorithm_of(choice: AlgorithmChoice) -> Make:
    """Return what makes the algorithm of a choice.

    Raises:
        SpecError: There is none of that name, or its file cannot be used.
        BrokenPlugin: It is of another package, which fails to import it.
    """
    make = _in_file(choice.use) if _IN_FILE in choice.use else _registered(choice.use)
    return lambda: make(**choice.options)


def absolute(use: str) -> str:
    """Return the name or file of an algorithm so that processes with other working folders find it, too."""
    return str(Path(use).resolve()) if _IN_FILE in use else use


def made(make: Make) -> Any:
    """Return an algorithm.

    Raises:
        SpecError: Making it fails, such as for an option that it does not have.
    """
    try:
        return make()
    except (Exception, SystemExit) as error:  # whatever somebody else's code does
        problem = f"cannot be made: {type(error).__name__}: {error}"
        raise SpecError("team", "algorithm", problem, "give the options that it takes in algorithm.options") from error


def is_distributed(algorithm: Any) -> bool:
    """Return whether each robot needs an object of its own.

    Raises:
        SpecError: It is no algorithm.
    """
    if not callable(getattr(algorithm, "decide", None)):
        remedy = "give a class of `touchline.team_algorithms`, as docs/guides/team-algorithms.md shows"
        raise SpecError("team", "algorithm", f"makes a {type(algorithm).__name__}, which has no `decide`", remedy)
    return callable(getattr(algorithm, "heard", None))


def check_algorithm(choice: AlgorithmChoice) -> None:
    """Check that an algorithm can be made, before robots and their coordinator are started.

    Raises:
        SpecError: There is none of that name, its file cannot be used, or making it fails.
        BrokenPlugin: It is of another package, which fails to import it.
    """
    if choice.use != EXTERNAL:
        is_distributed(made(algorithm_of(choice)))


def _registered(name: str) -> Callable[..., Any]:
    if not TEAM_ALGORITHMS.has(name):
        known = [*map(repr, TEAM_ALGORITHMS.names()), "FILE.py:NAME"]
        raise SpecError("team", "algorithm.use", f"is {name!r}", f"give {' or '.join(known)}")
    found: Callable[..., Any] = TEAM_ALGORITHMS.find(name)
    return found


def _in_file(use: str) -> Callable[..., Any]:
    """Return what a file calls by a name.

    Raises:
        SpecError: The file cannot be read or run, or has nothing of that name.
    """
    file, _, name = use.rpartition(":")
    path = Path(file).resolve()
    spec = importlib.util.spec_from_file_location(f"team_algorithm_{path.stem}", path)
    assert spec is not None and spec.loader is not None, "its name ends with .py"
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look for their module there
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:  # whatever somebody else's file does
        problem = f"cannot be run: {type(error).__name__}: {error}"
        raise SpecError(file, "", problem, "give a Python file that can be imported") from error
    found: Make | None = getattr(module, name, None)
    if not callable(found):
        remedy = f"give the name of a class or function in it: {', '.join(_offered(module)) or 'there is none'}"
        raise SpecError(file, "", f"has no class or function {name!r}", remedy)
    return found


def _offered(module: Any) -> list[str]:
    """Return names of classes with `decide` that a module itself defines."""
    return [
        name
        for name, each in vars(module).items()
        if isinstance(each, type) and each.__module__ == module.__name__ and hasattr(each, "decide")
    ]
