"""What the kernels of a drive or tool are chosen by."""

from __future__ import annotations

from typing import NamedTuple


class KernelClass(NamedTuple):
    """Base of classes that only have kernels, and no figures."""
