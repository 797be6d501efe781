"""Physical constants in SI units."""

from typing import Final

GRAVITY_MPS2: Final = 9.80665
"""Standard gravity (3rd CGPM, 1901)."""
