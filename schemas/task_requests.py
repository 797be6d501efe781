"""Requests to a team's dispatcher, in the words of Open-RMF, and the docks at which robots charge."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Literal

from pydantic import Field, model_validator

from touchline.schemas.docks import DockSpec
from touchline.schemas.errors import SpecError
from touchline.schemas.scenario import Coordinate
from touchline.schemas.spec import Spec

Point = tuple[Coordinate, Coordinate]
Place = Annotated[str, Field(min_length=1, max_length=64)] | Point
Share = Annotated[float, Field(ge=0, le=1)]
_Seconds = Annotated[float, Field(ge=0, le=100_000)]
_Priority = Annotated[int, Field(ge=0, le=9)]


class TaskRequest(Spec):
    """Fields that all requests have; times are s since the team began."""

    id: Annotated[str, Field(max_length=64)] = ""
    """Name of the task; empty: `task-` and a number."""
    earliest_start_s: _Seconds = 0.0
    """The robot is not at the first place to work before this."""
    deadline_s: _Seconds | None = None
    """Time by which the task is to be finished; later is late."""
    priority: _Priority = 0
    """A task of higher priority is never delayed for one of lower."""
    labels: Annotated[tuple[str, ...], Field(max_length=20)] = ()
    """Labels for people; they are in the report."""


class GoToPlaceRequest(TaskRequest):
    """Drive to a place, and stay for `dwell_s`."""

    category: Literal["go_to_place"]
    place: Place
    """Place to drive to."""
    dwell_s: _Seconds = 0.0
    """Time at it."""


class PatrolRequest(TaskRequest):
    """Visit places in turn, `rounds` times, and stay at each for `dwell_s`."""

    category: Literal["patrol"]
    places: Annotated[tuple[Place, ...], Field(min_length=1, max_length=100)]
    """Places in their order."""
    rounds: Annotated[int, Field(ge=1, le=1000)] = 1
    """Times that all are visited."""
    dwell_s: _Seconds = 0.0
    """Time at each."""


class DeliveryRequest(TaskRequest):
    """Pick goods up at one place, which takes `pickup_s`, and drop them off at another, which takes `dropoff_s`."""

    category: Literal["delivery"]
    pickup: Place
    """Place of the goods."""
    dropoff: Place
    """Place that they are brought to."""
    pickup_s: _Seconds = 5.0
    """Time to pick them up."""
    dropoff_s: _Seconds = 5.0
    """Time to drop them off."""


class ChargeRequest(TaskRequest):
    """Charge a robot up to `recharge_soc`."""

    category: Literal["charge"]
    robot: str | None = None
    """Name of the robot; null: the one with the least charge."""


Request = Annotated[GoToPlaceRequest | PatrolRequest | DeliveryRequest | ChargeRequest, Field(discriminator="category")]


class DispatchTask(Spec):
    """Requests for a dispatcher, which assigns them to robots by time and charge; robots charge at docks by themselves.

    Places are (x, y) in m, or names of `places`.
    """

    kind: Literal["dispatch"] = "dispatch"
    requests: Annotated[tuple[Request, ...], Field(max_length=10_000)] = ()
    """Requests; further ones may be added while the team is on the bus."""
    places: dict[str, Point] = Field(default_factory=dict)
    """Places (x, y in m) by the names that requests may use."""
    docks: Annotated[dict[str, DockSpec], Field(max_length=1000)] = Field(default_factory=dict)
    """Docks by name; one robot at a time charges at each."""
    charges: dict[str, Share] = Field(default_factory=dict)
    """Charge at the start, a share of the whole, of emulated robots by name; default: full."""
    recharge_threshold: Share = 0.2
    """An idle robot with less charge than this share goes to charge."""
    recharge_soc: Share = 1.0
    """Share up to which robots charge."""
    reserve_share: Share = 0.1
    """Share that is to be left when a robot has come to the nearest dock."""
    finishing_request: Literal["charge", "park", "nothing"] = "park"
    """Robots without tasks charge and park; park, where they started; or stay."""
    late_weight: Annotated[float, Field(ge=0, le=1000)] = 10.0
    """Cost of a second of lateness, relative to a second until a task is finished."""
    ends: bool = True
    """True: the run ends when all tasks have; false: further requests are waited for until its time is up."""

    @model_validator(mode="after")
    def _can_be_dispatched(self) -> DispatchTask:
        seen: set[str] = set()
        for number, request in enumerate(self.requests):
            if request.id and request.id in seen:
                raise ValueError(f"requests[{number}].id is {request.id!r} again: give each request another id")
            seen.add(request.id)
            for field, place in places_of(request).items():
                if isinstance(place, str) and place not in self.places:
                    known = ", ".join(sorted(self.places)) or "(x, y) in m"
                    raise ValueError(f"requests[{number}].{field} is {place!r}, no name of places: use {known}")
        if any(isinstance(each, ChargeRequest) for each in self.requests) and not self.docks:
            raise ValueError("docks is empty, but a request is to charge: give a dock")
        if self.finishing_request == "charge" and not self.docks:
            raise ValueError("docks is empty, but finishing_request is charge: give a dock, or use park")
        if self.recharge_soc <= self.recharge_threshold:
            raise ValueError("recharge_soc is not more than recharge_threshold: give a larger share")
        return self


def places_of(request: Request) -> dict[str, Place]:
    """Return the places that a request names, by field."""
    if isinstance(request, GoToPlaceRequest):
        return {"place": request.place}
    if isinstance(request, PatrolRequest):
        return {f"places[{number}]": place for number, place in enumerate(request.places)}
    if isinstance(request, DeliveryRequest):
        return {"pickup": request.pickup, "dropoff": request.dropoff}
    return {}


def located(request: Request, places: Mapping[str, Point]) -> list[Point]:
    """Return the places of a request (m).

    Raises:
        SpecError: It names an unknown one.
    """
    found = []
    for field, place in places_of(request).items():
        if isinstance(place, str) and place not in places:
            known = ", ".join(sorted(places)) or "(x, y) in m"
            raise SpecError("request", field, f"is {place!r}, which is no name of places", f"use {known}")
        found.append(places[place] if isinstance(place, str) else place)
    return found
