"""Contacts with each other and with walls are counted once each, by the tick, with who has touched whom."""

import numpy as np
import pytest

from touchline.coordination.body_contacts import BodyContacts
from touchline.coordination.free_area import FreeArea

HALL = FreeArea.of([(-2.0, -2.0), (8.0, -2.0), (8.0, 2.0), (-2.0, 2.0)])


def ticks(*rows: tuple[float, ...]) -> np.ndarray:
    """(ticks, n, 2) of robots on the x axis."""
    return np.array([[(x, 0.0) for x in row] for row in rows])


def test_two_that_stay_in_contact_touch_once() -> None:
    contacts = BodyContacts(2, 0.2, HALL)
    assert contacts.look(ticks((0.0, 0.5), (0.0, 0.39), (0.0, 0.3))) == {0, 1}
    assert contacts.look(ticks((0.0, 0.35), (0.0, 0.39))) == set()
    assert contacts.pairs == [(0, 1)]
    assert contacts.closest_m == pytest.approx(0.3)


def test_who_parts_and_touches_again_touches_twice() -> None:
    contacts = BodyContacts(2, 0.2, HALL)
    contacts.look(ticks((0.0, 0.3), (0.0, 0.5), (0.0, 0.3), (0.0, 0.5)))
    contacts.look(ticks((0.0, 0.39)))
    assert contacts.pairs == [(0, 1)] * 3


def test_who_touches_whom_is_told_by_number() -> None:
    contacts = BodyContacts(4, 0.2, HALL)
    assert contacts.look(ticks((0.0, 1.0, 1.3, 5.0), (0.0, 1.0, 1.3, 0.1))) == {0, 1, 2, 3}
    assert contacts.pairs == [(1, 2), (0, 3)]


def test_a_robot_alone_touches_nobody() -> None:
    contacts = BodyContacts(1, 0.2, HALL)
    assert contacts.look(ticks((0.0,))) == set()
    assert contacts.closest_m == np.inf


def test_who_drives_into_a_wall_touches_it_once() -> None:
    contacts = BodyContacts(2, 0.2, HALL)
    assert contacts.look(ticks((7.7, 0.0), (7.85, 1.0), (7.9, 2.0))) == {0}
    assert contacts.look(ticks((7.9, 3.0), (7.7, 4.0), (7.85, 5.0))) == {0}
    assert (contacts.at_walls, contacts.pairs) == ([0, 0], [])


def test_who_begins_at_a_wall_has_not_run_into_it() -> None:
    contacts = BodyContacts(1, 0.2, HALL)
    assert contacts.look(ticks((7.9,), (7.8,), (7.7,))) == set()
    assert contacts.at_walls == []
