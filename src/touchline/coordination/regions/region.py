"""Region: claims of its robots among its neighbours, and handover of robots between them.

The rules, of which docs/explanation/teams.md has the proof:

1. *Claim before use.* The owner of a robot sends its claims, the plan that the robot follows and the one proposed, to
   all neighbours near whom either is. Only when all have granted them the robot gets the new plan.
2. *Release after.* The old plan is a claim until the robot has reported which it follows.
3. A neighbour grants claims only if they keep apart from all plans of its own robots. Of two proposals that do not, the
   one with the lower (number, region) stays; the other is withdrawn, if its region has not sent it to the robot yet.
4. *Handover.* OFFER, ACCEPT; then the owner sends the robot OWNER with the next epoch, again and again until the robot
   reports that epoch, and no plans any more. The robot refuses everything of former epochs. Its report makes the new
   region its owner, which knows by that which plan it follows; all other claims are dead.
5. The robot's report is the truth. A region that has lost its memory grants, plans and accepts nothing until it has
   heard of every robot, owns those of its former life in a new epoch, and has all claims of its neighbours.

Nothing here reads a clock. Everything not yet answered is sent again at every call of `letters` and `orders`; answers,
which nobody answers, a few times.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass, field
from typing import Final, NamedTuple, TypeAlias

from touchline.coordination.regions.region_messages import (
    AllClaims,
    ClaimsAnswer,
    ClaimsRequest,
    HandoverAccept,
    HandoverOffer,
    Letter,
    OwnedState,
    OwnerOrder,
    PlanOrder,
    Plans,
    RegionLife,
    RobotClaims,
    TimedPlan,
    ToRegion,
    ToRobot,
)

Near: TypeAlias = Callable[[TimedPlan], Collection[int]]
"""Returns the regions near whom a plan is."""
InTheWay: TypeAlias = Callable[[str, TimedPlan], Iterable[tuple[str, int]]]
"""Returns own claims, by robot and number, that are too near to a plan of another region's robot."""

_NEARLY_S: Final = 1e-6


class Neighbourhood(NamedTuple):
    """Neighbours of a region.

    Attributes:
        neighbours: Regions that border on it, corners included.
        near: Finds the regions that a plan is near to, this one among them.
    """

    neighbours: frozenset[int]
    near: Near


@dataclass
class OwnRobot:
    """Knowledge of one robot by its owner.

    Attributes:
        epoch: Epoch of the ownership.
        followed: Number of the plan that it is known to follow.
        claims: That plan, and the proposed one if there is any.
        highest: Highest number that it has ever been sent.
        version: Version of the claims.
        proposal: Number of the proposed plan; None: there is none.
        asked: Version with which the proposal was sent to neighbours.
        needed: Neighbours that must grant it.
        sent: Whether the robot may have got it.
        granted: Newest version that each neighbour has granted.
        holders: Neighbours that may hold claims.
        offered: Region that it is offered to; None: none.
        heir: The life of that which has accepted.
    """

    epoch: int
    followed: int
    claims: dict[int, TimedPlan]
    highest: int
    holders: set[int]
    version: int = 1
    proposal: int | None = None
    asked: int = 0
    needed: frozenset[int] = frozenset()
    sent: bool = False
    granted: dict[int, int] = field(default_factory=dict)
    offered: int | None = None
    heir: RegionLife | None = None


class Region:
    """Claims and handovers of one region.

    Attributes:
        name: The region, and its life.
        own: Robots that it owns, by name.
        foreign: Newest claims of other robots, by name.
        handed_over: Number of robots that it has got from others.
        repeats: Calls of `letters` in which an answer is sent once more; 0 suits links that lose nothing.
    """

    repeats = 4

    def __init__(
        self, name: RegionLife, started_s: float, places: Neighbourhood, robots: Collection[str], in_the_way: InTheWay
    ) -> None:
        """Start without any memory.

        Args:
            name: The region, and a life later than all before.
            started_s: Robots' clock: what they reported before may not be true any more.
            places: Neighbours of the region.
            robots: Names of all robots of the team.
            in_the_way: Finds own claims that are too near to a plan.
        """
        self.name, self._started_s = name, started_s
        (self._neighbours, self._near), self._in_the_way = places, in_the_way
        self.own: dict[str, OwnRobot] = {}
        self.foreign: dict[str, RobotClaims] = {}
        self.handed_over = 0
        self._unheard, self._unsynced = set(robots), set(self._neighbours)
        self._reports: dict[str, OwnedState] = {}
        self._orphans: dict[str, OwnedState] = {}
        self._lives: dict[int, int] = {}
        self._answers: dict[tuple[str, int], tuple[ToRegion, int]] = {}

    @property
    def _knows_its_own(self) -> bool:
        """True once it has heard of every robot and owns those of its former life."""
        return not self._unheard and not self._orphans

    @property
    def ready(self) -> bool:
        """True once it may plan, grant and accept."""
        return self._knows_its_own and not self._unsynced

    def _is_orphan(self, report: OwnedState) -> bool:
        """Return whether a robot belongs to a former life, or to nobody while it is here."""
        if report.owner is None:
            return self._contains(report.plan)
        return report.owner.region == self.name.region and report.owner != self.name

    def _contains(self, plan: TimedPlan) -> bool:
        """Return whether it is the first of the regions that a plan is near to; some region is for every plan."""
        return min(self._near(plan), default=self.name.region) == self.name.region

    def free(self, robot: str) -> bool:
        """Return whether a robot may get a plan: it is owned, not being handed over, and no other plan is open."""
        own = self.own.get(robot)
        return self.ready and own is not None and own.proposal is None and own.heir is None

    def propose(self, robot: str, plan: TimedPlan) -> None:
        """Propose a plan for a robot that is free; the plan must keep apart from all claims that are known.

        Args:
            robot: Its name.
            plan: A plan that is the one it follows up to its branch.
        """
        own = self.own[robot]
        own.highest += 1
        own.claims[own.highest] = plan
        own.proposal, own.sent = own.highest, False
        own.version += 1
        own.asked, own.needed = own.version, self._concerned(own)

    def offer(self, robot: str, to: int | None) -> None:
        """Offer a robot to a neighbour, or to nobody any more; what has been accepted goes on."""
        own = self.own[robot]
        if own.heir is None:
            own.offered = to

    def hear(self, report: OwnedState) -> None:
        """Take a robot's report, in any order."""
        robot, last = report.robot, self._reports.get(report.robot)
        if report.stamp_s <= (last.stamp_s if last is not None else self._started_s):
            return
        self._reports[robot] = report
        self._unheard.discard(robot)
        self._orphans.pop(robot, None)
        if self._is_orphan(report):
            self._orphans[robot] = report
        own, foreign = self.own.get(robot), self.foreign.get(robot)
        newer = (own is None or report.epoch > own.epoch) and (foreign is None or report.epoch >= foreign.epoch)
        if report.owner == self.name and newer:
            before = last.owner if last is not None else None
            self.handed_over += before is not None and before.region != self.name.region
            self._begin_to_own(report)
        elif own is not None and report.epoch > own.epoch:
            del self.own[robot]
            self.foreign[robot] = RobotClaims(robot, own.epoch, own.version, dict(own.claims))
        elif own is not None and report.epoch == own.epoch:
            self._settle(own, report)
        elif own is None and (foreign.epoch < report.epoch if foreign is not None else not self.ready):
            # It refuses all of former epochs, and what its new owner asks for has not been granted here yet.
            self.foreign[robot] = RobotClaims(robot, report.epoch, 0, {report.adopted: report.plan})

    def _begin_to_own(self, report: OwnedState) -> None:
        """Own a robot from now on: whatever it was sent before, it refuses."""
        self.foreign.pop(report.robot, None)
        self.own[report.robot] = OwnRobot(
            epoch=report.epoch,
            followed=report.adopted,
            claims={report.adopted: report.plan},
            highest=report.decided,
            holders=set(self._neighbours),
        )

    def _settle(self, own: OwnRobot, report: OwnedState) -> None:
        """Release the plan that a robot does not follow, once that is certain."""
        if own.proposal is None:
            return
        if report.adopted == own.proposal:
            own.claims, own.followed = {own.proposal: own.claims[own.proposal]}, own.proposal
        elif report.decided < own.proposal and report.stamp_s <= own.claims[own.proposal].branch_s + _NEARLY_S:
            return
        else:
            del own.claims[own.proposal]
        own.proposal, own.version = None, own.version + 1

    def receive(self, letter: Letter) -> list[Letter]:
        """Take a message of another region, in any order; return the answers."""
        sender, message = letter.sender, letter.message
        known_life = self._lives.get(sender.region, sender.life)
        if sender.life < known_life:
            return []  # of a life that has ended
        self._lives[sender.region] = sender.life
        if sender.life > known_life:
            self._ask_anew(sender.region)
        answer: ClaimsAnswer | HandoverAccept | AllClaims | None = None
        if isinstance(message, RobotClaims):
            answer = self._answer_to_claims(message, sender.region)
        elif isinstance(message, ClaimsAnswer):
            self._take_answer(message, sender.region)
        elif isinstance(message, HandoverOffer):
            answer = HandoverAccept(message.robot, message.epoch) if self.ready else None
        elif isinstance(message, HandoverAccept):
            self._take_acceptance(message, sender)
        elif isinstance(message, ClaimsRequest):
            answer = self._all_claims(sender.life) if self._knows_its_own else None
        else:
            self._take_all(message, sender.region)
        if answer is None:
            return []
        robot = "" if isinstance(answer, AllClaims) else answer.robot
        if self.repeats:
            self._answers[robot, sender.region] = answer, self.repeats
        return [Letter(self.name, sender.region, answer)]

    def _ask_anew(self, region: int) -> None:
        """Have a neighbour that has lost its memory grant all claims again."""
        for own in self.own.values():
            own.granted.pop(region, None)
            own.holders.add(region)

    def _answer_to_claims(self, claims: RobotClaims, sender: int) -> ClaimsAnswer | None:
        """Return the answer to claims; None if they are old, or nothing is known yet."""
        robot, own, known = claims.robot, self.own.get(claims.robot), self.foreign.get(claims.robot)
        if not self.ready or (own is not None and own.epoch >= claims.epoch):
            return None
        at = claims.epoch, claims.version
        if known is not None and at < (known.epoch, known.version):
            return None
        if known is None or at > (known.epoch, known.version):
            kept = known.plans if known is not None and known.epoch == claims.epoch else {}
            if not self._makes_room(claims, kept, sender):
                return ClaimsAnswer(robot, *at, granted=False)
            self.foreign[robot] = claims
            self.own.pop(robot, None)  # the robot has told its new owner, though not yet this region
        return ClaimsAnswer(robot, *at, granted=True)

    def _makes_room(self, claims: RobotClaims, before: Plans, sender: int) -> bool:
        """Return whether own plans keep apart from claims, after own proposals that come second are withdrawn."""
        second: list[OwnRobot] = []
        for number, plan in claims.plans.items():
            if number in before:
                continue
            for robot, other in self._in_the_way(claims.robot, plan):
                own = self.own[robot]
                if other != own.proposal or own.sent or (other, self.name.region) < (number, sender):
                    return False
                second.append(own)
        for own in second:
            self._withdraw(own)
        return True

    def withdraw_late(self, before_s: float) -> None:
        """Withdraw proposals that no robot has been sent, and that would have to be there before a time."""
        for own in self.own.values():
            if own.proposal is not None and not own.sent and own.claims[own.proposal].branch_s < before_s:
                self._withdraw(own)

    @staticmethod
    def _withdraw(own: OwnRobot) -> None:
        """Withdraw a proposal that the robot has not been sent."""
        if own.proposal is not None:
            del own.claims[own.proposal]
            own.proposal, own.version = None, own.version + 1

    def _take_answer(self, answer: ClaimsAnswer, sender: int) -> None:
        own = self.own.get(answer.robot)
        if own is None or answer.epoch != own.epoch:
            return
        if answer.granted:
            own.granted[sender] = max(own.granted.get(sender, 0), answer.version)
            if answer.version == own.version and sender not in self._concerned(own):
                own.holders.discard(sender)
        elif answer.version == own.asked and not own.sent:
            self._withdraw(own)

    def _take_acceptance(self, acceptance: HandoverAccept, sender: RegionLife) -> None:
        own = self.own.get(acceptance.robot)
        if own is not None and own.epoch == acceptance.epoch and own.offered == sender.region:
            own.heir = sender

    def _all_claims(self, life: int) -> AllClaims:
        """Return all claims, own and others', for a region that has lost its memory."""
        own = (RobotClaims(robot, each.epoch, each.version, dict(each.claims)) for robot, each in self.own.items())
        return AllClaims(life, (*own, *self.foreign.values()))

    def _take_all(self, known: AllClaims, sender: int) -> None:
        if known.life != self.name.life or sender not in self._unsynced:
            return
        self._unsynced.discard(sender)
        for claims in known.claims:
            before, own = self.foreign.get(claims.robot), self.own.get(claims.robot)
            newer = before is None or (claims.epoch, claims.version) > (before.epoch, before.version)
            if newer and (own is None or claims.epoch > own.epoch):
                self.foreign[claims.robot] = claims

    def _concerned(self, own: OwnRobot) -> frozenset[int]:
        """Return the neighbours near whom a robot's claims are."""
        return frozenset().union(*map(self._near, own.claims.values())) & self._neighbours

    def _granted(self, own: OwnRobot) -> bool:
        """Return whether all neighbours concerned keep the proposal clear."""
        return all(own.granted.get(each, 0) >= own.asked for each in own.needed)

    def letters(self) -> list[Letter]:
        """Return messages to other regions, until they are answered."""
        found = [Letter(self.name, each, ClaimsRequest()) for each in sorted(self._unsynced)]
        found += [Letter(self.name, to, answer) for (_, to), (answer, _) in self._answers.items()]
        self._answers = {key: (answer, left - 1) for key, (answer, left) in self._answers.items() if left > 1}
        for robot, own in self.own.items() if self._knows_its_own else ():
            concerned = self._concerned(own)
            own.holders |= concerned
            for each in sorted(own.holders):
                if own.granted.get(each, 0) < own.version:
                    plans = dict(own.claims) if each in concerned else {}
                    found.append(Letter(self.name, each, RobotClaims(robot, own.epoch, own.version, plans)))
            if own.offered is not None and own.heir is None and self.ready:
                found.append(Letter(self.name, own.offered, HandoverOffer(robot, own.epoch)))
        return found

    def orders(self) -> list[ToRobot]:
        """Return messages to robots, until they report that they have taken them."""
        found: list[ToRobot] = [OwnerOrder(each.robot, self.name, each.epoch + 1) for each in self._orphans.values()]
        for robot, own in self.own.items() if self.ready else ():
            if own.heir is not None:
                found.append(OwnerOrder(robot, own.heir, own.epoch + 1))
            elif own.proposal is not None and self._granted(own):
                own.sent = True
                plan = own.claims[own.proposal]
                found.append(PlanOrder(robot, self.name, own.epoch, own.proposal, own.followed, plan))
        return found
