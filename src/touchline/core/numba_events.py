"""Compilations by Numba in this process, whoever asks for them."""

from collections.abc import Callable
from contextlib import AbstractContextManager
from functools import cache
from typing import Any

from numba.core import event


class _Listener(event.Listener):
    def __init__(self, compiling: Callable[[Any], AbstractContextManager[None]]) -> None:
        self._compiling = compiling
        self._open: list[AbstractContextManager[None]] = []

    def on_start(self, event: Any) -> None:
        """Numba begins to compile a function."""
        self._open.append(self._compiling(event.data["dispatcher"].py_func))
        self._open[-1].__enter__()

    def on_end(self, event: Any) -> None:
        """It is done with that."""
        self._open.pop().__exit__(None, None, None)


@cache
def forward(compiling: Callable[[Any], AbstractContextManager[None]]) -> None:
    """Enter that context, made for the function, around each compilation from now on."""
    event.register("numba:compile", _Listener(compiling))
