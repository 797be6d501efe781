"""A kernel as the compiler sees it."""

from collections.abc import Callable
from typing import Any


class KernelFunction:
    """A function in the part of Python that Numba compiles.

    Attributes:
        py_func: The function.
        counting: Whether references to arrays are counted, or arrays only borrowed.
        locked: Whether other threads of Python wait while it runs.
        dispatcher: What the compiler keeps of it.
    """

    def __init__(self, function: Callable[..., Any], *, counting: bool = True, locked: bool = True) -> None:
        self.py_func, self.counting, self.locked = function, counting, locked
        self.dispatcher: Any = None


class ClassFunction(KernelFunction):
    """Stands for the kernel of its name in the class of its first argument."""

    def meant(self, kind: type) -> Any:
        """The kernel of that class."""
        return getattr(kind, self.py_func.__name__)
