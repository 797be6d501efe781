"""Contacts are the same in whatever order the ways of different robots arrive."""

from itertools import permutations

import numpy as np
import pytest

from tests.fleet.test_reported_contacts import FIELD, way
from touchline.coordination.reported_contacts import ReportedContacts
from touchline.jobs.team.contact_order import LATE_S, ContactsInOrder

A = {2: (0.0, 0.1), 4: (0.7, 0.5), 6: (0.5, 0.5)}
B = {2: (1.0, 1.0), 4: (1.0, 0.85), 6: (0.95, 1.0)}
TOLD = [("a", tick, places) for tick, places in A.items()] + [("b", tick, places) for tick, places in B.items()]


def contacts_of(told, now_s, robots=2):
    """Contacts that are counted of ways that arrive at given times."""
    contacts, clock = ReportedContacts(["a", "b"], 0.2, FIELD), [0.0]
    ways = ContactsInOrder(contacts, robots, lambda: clock[0])
    for (name, tick, places), clock[0] in zip(told, now_s, strict=True):
        ways.take(name, way(tick, *places))
        ways.look()
    ways.look(complete=True)
    return contacts.contacts.pairs, contacts.contacts.closest_m


@pytest.mark.parametrize("turns", sorted(set(permutations("aaabbb"))))
def test_any_order_in_which_each_robot_keeps_its_own(turns):
    each = {name: iter([one for one in TOLD if one[0] == name]) for name in "ab"}
    pairs, closest_m = contacts_of([next(each[name]) for name in turns], np.linspace(0.0, 0.9 * LATE_S, 6))
    assert pairs == [(0, 1)]
    assert closest_m == pytest.approx(0.3)


def test_who_is_silent_is_waited_for_no_longer_than_that_and_stands_where_it_was():
    silent = [one for one in TOLD if one[:2] != ("b", 4)]
    pairs, closest_m = contacts_of(sorted(silent, key=lambda one: one[1]), [0.0, 0.0, 0.1, 2.0 * LATE_S, 2.0 * LATE_S])
    assert pairs == [(0, 1)]
    assert closest_m == pytest.approx(0.3)


def test_a_way_that_comes_too_late_is_where_it_is_next_and_does_no_harm():
    late = [("a", 2, A[2]), ("b", 2, B[2]), ("a", 4, A[4]), ("a", 6, A[6]), ("b", 4, B[4]), ("b", 6, B[6])]
    pairs, _ = contacts_of(late, [0.0, 0.0, 0.0, 1.1 * LATE_S, 1.2 * LATE_S, 1.2 * LATE_S])
    assert pairs == [(0, 1)]
