"""Ids of the swaths of an area and of the parts of a line: the own one with a number, counted from 1."""

from collections.abc import Container
from typing import Final

SWATH_MARK: Final = "#"


def swath_id(area_id: str, number: int) -> str:
    """The segment id of a swath of an area."""
    return f"{area_id}{SWATH_MARK}{number}"


def area_id_of(segment_id: str) -> str:
    """The id of the area of which a segment is a swath, by its own id; "" if that is none of a swath."""
    area_id, mark, number = segment_id.rpartition(SWATH_MARK)
    return area_id if mark and number.isdecimal() else ""


def line_part_id(line_id: str, number: int) -> str:
    """The segment id of a part of a line round something that stands on it."""
    return f"{line_id} ({number})"


def line_id_of(segment_id: str) -> str:
    """The id of the line of which a segment is a part, by its own id; "" if that is none of a part."""
    line_id, mark, number = segment_id.rpartition(" (")
    return line_id if mark and number.endswith(")") and number[:-1].isdecimal() else ""


def whole_line_id(segment_id: str, lines: Container[str]) -> str:
    """The id of the line of which a segment is the whole, a part, or a part of a part; "" if it is of none of these."""
    while segment_id and segment_id not in lines:
        segment_id = line_id_of(segment_id)
    return segment_id
