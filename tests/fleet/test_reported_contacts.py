"""Contacts by what robots tell at exchanges: those of one who sees all places, whoever is late, silent or gone."""

import numpy as np
import pytest

from touchline.coordination.free_area import FreeArea
from touchline.coordination.guidance_messages import header_at
from touchline.coordination.reported_contacts import ReportedContacts
from touchline.schemas.messages import TrueWay

FIELD = FreeArea.of(
    ((-9.0, -9.0), (9.0, -9.0), (9.0, 9.0), (-9.0, 9.0)), [((6.0, -1.0), (7.0, -1.0), (7.0, 1.0), (6.0, 1.0))]
)


def way(tick: int, *x_m: float) -> TrueWay:
    """A way along the x axis, up to a tick."""
    return TrueWay(header=header_at(tick), x_m=np.array(x_m), y_m=np.zeros(len(x_m)))


def test_a_touch_between_two_exchanges_is_told_at_the_second_and_once() -> None:
    told = ReportedContacts(["b", "a", "c"], 0.2, FIELD)
    for name, places in {"a": (0.0, 0.1), "b": (1.0, 1.0), "c": (5.0, 5.0)}.items():
        told.take(name, way(2, *places))
    assert told.look(2) == ()
    for name, places in {"a": (0.7, 0.5), "b": (1.0, 1.0), "c": (5.0, 5.0)}.items():
        told.take(name, way(4, *places))
    assert told.look(4) == ("a", "b")
    assert told.contacts.closest_m == pytest.approx(0.3)
    assert told.contacts.pairs == [(0, 1)]


def test_who_is_silent_stands_where_it_was_and_who_has_left_is_nowhere() -> None:
    told = ReportedContacts(["a", "b"], 0.2, FIELD)
    told.take("a", way(2, 0.0, 0.0))
    assert told.look(2) == ()  # b has never said anything
    told.take("b", way(4, 2.0, 1.0))
    told.take("a", way(4, 0.0, 0.0))
    assert told.look(4) == ()
    told.take("a", way(6, 0.5, 0.7))
    assert told.look(6) == ("a", "b")
    told.leave("b")
    told.take("a", way(8, 0.9, 1.0))
    assert told.look(8) == ()
    assert told.contacts.closest_m == pytest.approx(0.3)


def test_a_wall_that_is_touched_between_two_exchanges_is_a_contact_and_told_once() -> None:
    told = ReportedContacts(["a", "b"], 0.2, FIELD)
    told.take("a", way(3, 5.5, 5.85, 5.7))
    assert told.look(3) == ("a",)
    told.take("a", way(6, 5.7, 5.9, 5.9))
    assert told.look(6) == ("a",)
    told.take("a", way(9, 5.9, 5.9, 5.9))
    assert told.look(9) == ()
    assert told.contacts.at_walls == [0, 0]
