"""Ids of the swaths of an area: the area's own, a mark, and the number of the swath, counted from 1."""

from typing import Final

SWATH_MARK: Final = "#"


def swath_id(area_id: str, number: int) -> str:
    """The segment id of a swath of an area."""
    return f"{area_id}{SWATH_MARK}{number}"


def area_id_of(segment_id: str) -> str:
    """The id of the area of which a segment is a swath, by its own id; "" if that is none of a swath."""
    area_id, mark, number = segment_id.rpartition(SWATH_MARK)
    return area_id if mark and number.isdecimal() else ""
