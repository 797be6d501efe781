"""Base of classes by which the kernels of a drive or tool are chosen."""

from __future__ import annotations

from typing import NamedTuple


class KernelClass(NamedTuple):
    """Base of classes that only have kernels, and no parameters."""
