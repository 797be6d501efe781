"""How swaths of an area are named, for those who plan them and those who drive them."""

from typing import Final

SWATH_MARK: Final = "#"
"""Between the id of an area and the number of one of its swaths."""
