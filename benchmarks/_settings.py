"""Benchmarks by name, and their settings, which are the parameters of each `main`.

A module has `main`, which prints its figures, and `SMALL`, a run that takes seconds.
"""

import importlib
import inspect
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any, Final, NamedTuple

_OURS: Final = ("benchmarks", "touchline")


class NotHereError(Exception):
    """A benchmark cannot be run on this machine; the text is why."""


class Small(NamedTuple):
    """A run that takes seconds, to see that a benchmark works; its figures mean nothing.

    Attributes:
        settings: Arguments of `main`.
        lines: Parts of lines that it prints, with their units; # stands for a finite number.
    """

    settings: Mapping[str, Any]
    lines: tuple[str, ...]


def available() -> list[str]:
    """Names of all benchmarks."""
    return sorted(path.stem for path in Path(__file__).parent.glob("*.py") if not path.stem.startswith("_"))


def benchmark(name: str) -> ModuleType:
    """The module of a benchmark.

    Raises:
        NotHereError: It needs a package that is not installed.
    """
    try:
        return importlib.import_module(f"benchmarks.{name}")
    except ModuleNotFoundError as error:
        package = (error.name or "").partition(".")[0]
        if package in _OURS:
            raise
        raise NotHereError(f"the package {package} is not installed") from error


def parsed(module: ModuleType, texts: Sequence[str]) -> dict[str, Any]:
    """Arguments of a benchmark's `main` from texts like `runs=20`, each of the type of its default.

    Raises:
        ValueError: There is no such setting, or the value is not of its type.
    """
    defaults = {name: each.default for name, each in inspect.signature(module.main).parameters.items()}
    found = dict[str, Any]()
    for text in texts:
        name, _, value = text.partition("=")
        if name not in defaults:
            there_are = ", ".join(f"{each}={default}" for each, default in defaults.items()) or "none"
            raise ValueError(f"{module.__name__}: no setting {name}; there are: {there_are}")
        try:
            found[name] = type(defaults[name])(value)
        except ValueError as error:
            raise ValueError(f"{module.__name__}: {text}: {error}") from error
    return found
