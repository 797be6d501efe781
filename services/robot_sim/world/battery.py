"""Battery: ten lithium cells in series."""

from __future__ import annotations

from typing import Final

from touchline.core.jit import kernel

EMPTY_V: Final = 33.0
FULL_V: Final = 42.0
NOMINAL_V: Final = 37.0


@kernel
def voltage_of(charge: float) -> float:
    """Compute the voltage [V], linear in the charge, a share 0…1 of the full one."""
    return EMPTY_V + (FULL_V - EMPTY_V) * charge
