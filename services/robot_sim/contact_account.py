"""Contacts of the robot with things: the event for the operator, and the report."""

from __future__ import annotations

from collections.abc import Sequence

from touchline.onboard.interface import OnboardEvent
from touchline.schemas import messages as m
from touchline.services.robot_sim.world.objects.surroundings import Contact


def contact_event(contact: Contact) -> OnboardEvent:
    """Return the event that tells the operator of a contact."""
    place = f"at ({contact.east_m:.2f}, {contact.north_m:.2f}) m"
    if contact.robot_mps:
        text = f"the robot hit {contact.thing} {place}: it moved at {contact.robot_mps:.2f} m/s there"
        return OnboardEvent(m.Event.ERROR, "contact", f"{text}, the contact took {contact.energy_j:.1f} J")
    text = f"{contact.thing} ran into the robot at rest {place}, at {contact.closing_mps:.2f} m/s"
    return OnboardEvent(m.Event.WARN, "contact", text)


def contact_report(header: m.Header, contacts: Sequence[Contact]) -> m.ContactReport | None:
    """Return the report of the contacts of a traversal; None if there were none."""
    if not contacts:
        return None
    return m.ContactReport(
        header=header,
        while_moving=sum(contact.robot_mps > 0.0 for contact in contacts),
        contacts=tuple(
            m.ThingContact(
                stamp=m.Time.of_ns(contact.tick * 10_000_000),
                thing=contact.thing,
                x_m=contact.east_m,
                y_m=contact.north_m,
                robot_mps=contact.robot_mps,
                closing_mps=contact.closing_mps,
                energy_j=contact.energy_j,
            )
            for contact in contacts
        ),
    )
