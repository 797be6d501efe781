"""How every numerical kernel is compiled.

Kernels are cached on disk, so only the first start after an installation compiles. ``fastmath`` stays off: the same
scenario must give the same bits on every run.
"""

from collections.abc import Callable
from typing import Any

import numba

kernel: Callable[..., Any] = numba.njit(cache=True, error_model="numpy")
