"""Hazards: reasons to stop the robot whatever its pose, one row for each of them in the table `HAZARDS`.

A row is a class with the compiled condition of a hazard (`present`), its text for people (`words`) and the source that
a pause names (`name`, `by`), and a line of the table with its code and its answer. To add a hazard, add such a class
and such a line; one that must last also needs a field of `SafetyFindings`, counted in `failsafe`.

There are three answers: an EMERGENCY latches until a reset; a stop lasts until somebody says `resume`, and resume is
refused as long as a cause that LASTS can still be seen; one that PASSES cannot be seen at standstill.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Final, NamedTuple

from touchline.core.jit import kernel, kernel_of_class
from touchline.onboard.computer_state import FLOW_WINDOW_TICKS, ComputerState, SafetyFindings
from touchline.onboard.executive.geofence import FenceArrays, Geofence
from touchline.schemas import supplies
from touchline.schemas.messages import PauseStatus

OPERATOR_TIMEOUT_S: Final = 2.0
LOW_BATTERY: Final = supplies.LOW_BATTERY
LOW_TANK_L: Final = supplies.LOW_TANK_L
DRY_TANK_L: Final = 0.0005
ACTUATOR_TIMEOUT_S: Final = 0.4
LEAK_SHARE: Final = 0.4
"""Share of the nominal flow, over the window, above which a closed valve counts as stuck open."""
DRY_SHARE: Final = 0.8
"""Share of the nominal flow, over the window, below which nothing comes out of the open valve, or so little that the
line is narrow."""

NOTHING: Final = 0
"""Instead of a code: there is no hazard."""
EMERGENCY: Final = 1
LASTS: Final = 2
PASSES: Final = 3


class SafetyMoment(NamedTuple):
    """A tick, and the fence round the loaded plan."""

    tick: int
    fence: FenceArrays


@dataclass
class HazardContext:
    """Data for the texts about hazards.

    Attributes:
        findings: Findings of the last tick.
        disobeyed: By actuator, the text if it does not follow its command.
        fence: Fence round the loaded plan.
    """

    findings: SafetyFindings
    disobeyed: Sequence[str]
    fence: Geofence | None = None


class NoHazard(NamedTuple):
    """End of a chain of hazards."""

    @kernel
    def first_found(self, _moment: SafetyMoment, _c: ComputerState) -> int:
        """See the kernel `first_found`: NOTHING."""
        return NOTHING


class HazardLine(NamedTuple):
    """Line of the table.

    Attributes:
        code: Code in the findings; of several of a kind that of the first, the others follow.
        answer: EMERGENCY, LASTS or PASSES.
        rest: Hazards of the same answer that come after it, for kernels.
    """

    code: int
    answer: int
    rest: Any = NoHazard()


class Hazard(HazardLine):
    """Base of the hazards.

    Attributes:
        name: Name of the cause, in the status of a pause.
        text: Text for people, if it is always the same.
        by: Source of the pause.
        codes: Number of codes it takes, as there are several of a kind.
    """

    name: ClassVar[str]
    text: ClassVar[str] = ""
    by: ClassVar[int] = PauseStatus.HAZARD
    codes: ClassVar[int] = 1

    @kernel
    def first_found(self, moment: SafetyMoment, c: ComputerState) -> int:
        """See the kernel `first_found`, beginning with this hazard."""
        number: int = present(self, moment, c)
        if number > 0:
            return self.code + number - 1
        rest: int = first_found(self.rest, moment, c)
        return rest

    def words(self, _seen: HazardContext, _which: int) -> str:
        """Return the text for people.

        Args:
            _seen: Findings and figures for the text.
            _which: Index among several of a kind.
        """
        return self.text


@kernel_of_class
def present(_hazard: Any, _moment: SafetyMoment, _c: ComputerState) -> int:
    """Return the number of the hazard of its kind that is present, from 1; 0 if none is.

    Args:
        _hazard: The hazard.
        _moment: Tick and fence.
        _c: State of the computer, with the observations of the failsafe.
    """
    raise NotImplementedError


@kernel_of_class
def first_found(_chain: Any, _moment: SafetyMoment, _c: ComputerState) -> int:
    """Return the code of the first hazard of a chain that is present, or NOTHING.

    Args:
        _chain: First hazard of the chain.
        _moment: Tick and fence.
        _c: State of the computer.
    """
    raise NotImplementedError


class BumperPressed(Hazard):
    """The bumper is pressed."""

    name = "bumper"
    text = "the bumper is pressed"

    @kernel
    def present(self, _moment: SafetyMoment, c: ComputerState) -> int:
        """See the kernel `present`."""
        return 1 if c.frame.bumper else 0


class FenceLeft(Hazard):
    """The body has been beyond the fence for too long."""

    name = "fence"

    @kernel
    def present(self, moment: SafetyMoment, c: ComputerState) -> int:
        """See the kernel `present`: there is a fence, and the body has been beyond it for the timeout."""
        fenced = len(moment.fence.outline) > 0 and c.times.first_tick >= 0
        return 1 if fenced and c.safety.outside_s >= c.safety.fence_timeout_s else 0

    def words(self, seen: HazardContext, _which: int) -> str:
        """See the base: with the figures."""
        if seen.fence is None:
            return "the robot has left its fence"
        return f"the robot has left {seen.fence.name} by more than {seen.fence.margin_m:g} m"


class OperatorUnheard(Hazard):
    """Nobody who could stop the robot is heard."""

    name = "operator not heard"
    by = PauseStatus.LINK
    text = f"the operator has not been heard for {OPERATOR_TIMEOUT_S:.0f} s"

    @kernel
    def present(self, _moment: SafetyMoment, c: ComputerState) -> int:
        """See the kernel `present`: the operator has not been heard for the timeout."""
        return 1 if c.safety.unheard_s > OPERATOR_TIMEOUT_S else 0


class TankEmptied(Hazard):
    """The tank is empty."""

    name = "tank-empty"
    text = "the tank is empty"

    @kernel
    def present(self, _moment: SafetyMoment, c: ComputerState) -> int:
        """See the kernel `present`: a sprayer has no paint."""
        return 1 if c.safety.nominal_l > 0.0 and c.frame.tank_l <= DRY_TANK_L else 0


class TankLow(Hazard):
    """The tank is almost empty."""

    name = "tank-low"
    text = "the tank is all but empty"

    @kernel
    def present(self, _moment: SafetyMoment, c: ComputerState) -> int:
        """See the kernel `present`: a sprayer has less paint than LOW_TANK_L."""
        return 1 if c.safety.nominal_l > 0.0 and c.frame.tank_l < LOW_TANK_L else 0


class BatteryFlat(Hazard):
    """The battery is almost empty."""

    name = "battery-low"

    @kernel
    def present(self, _moment: SafetyMoment, c: ComputerState) -> int:
        """See the kernel `present`: the charge is less than LOW_BATTERY."""
        return 1 if c.frame.battery_fraction < LOW_BATTERY else 0

    def words(self, seen: HazardContext, _which: int) -> str:
        """See the base: with the charge."""
        return f"the battery is low ({100.0 * seen.findings.battery_fraction:.0f} %)"


class ValveLeaks(Hazard):
    """Paint leaves the tank while the valve is closed."""

    name = "valve-leaks"
    text = "paint comes out although the valve is closed"

    @kernel
    def present(self, _moment: SafetyMoment, c: ComputerState) -> int:
        """See the kernel `present`: by the flow out of the tank."""
        found = c.safety
        if found.nominal_l <= 0.0 or c.command.valve or found.flow_count < FLOW_WINDOW_TICKS:
            return 0
        return 1 if flow_share(found) > LEAK_SHARE else 0


class ActuatorDisobeys(Hazard):
    """An actuator has not followed its command for too long; of several, the last one counts."""

    name = "actuator"
    codes = 64
    """Larger than the number of actuators of any drive."""

    @kernel
    def present(self, moment: SafetyMoment, c: ComputerState) -> int:
        """See the kernel `present`: the last such actuator, in a tick with angles of the encoders."""
        number = 0
        if c.frame.encoder_tick == moment.tick:
            for i in range(len(c.safety.astray_s)):
                if c.safety.astray_s[i] >= ACTUATOR_TIMEOUT_S:
                    number = i + 1
        return number

    def words(self, seen: HazardContext, which: int) -> str:
        """See the base: the text of the actuator."""
        return seen.disobeyed[which]


class TooLittlePaint(Hazard):
    """Too little paint leaves the tank while the valve is open."""

    name = "too-little-paint"
    text = "the valve is open, but too little paint comes out"

    @kernel
    def present(self, _moment: SafetyMoment, c: ComputerState) -> int:
        """See the kernel `present`: by the flow out of the tank."""
        return 1 if c.safety.nominal_l > 0.0 and c.command.valve and too_little_flows(c.safety) else 0


@kernel
def flow_share(found: SafetyFindings) -> float:
    """Return the paint that has left the tank over a full window, relative to the flow through the open valve."""
    return found.flow_sum_l / (FLOW_WINDOW_TICKS * found.nominal_l)


@kernel
def too_little_flows(found: SafetyFindings) -> bool:
    """Return True if over a full window less paint has left the tank than a line takes."""
    return found.flow_count >= FLOW_WINDOW_TICKS and flow_share(found) < DRY_SHARE


HAZARDS: Final[tuple[Hazard, ...]] = (
    BumperPressed(1, EMERGENCY),
    FenceLeft(2, EMERGENCY),
    OperatorUnheard(3, LASTS),
    TankEmptied(4, LASTS),
    TankLow(5, LASTS),
    BatteryFlat(6, LASTS),
    ValveLeaks(21, LASTS),
    ActuatorDisobeys(22, PASSES),
    TooLittlePaint(20, PASSES),
)
"""All hazards; of each answer the first that is present is reported. Those that last come before those that pass."""


class HazardChains(NamedTuple):
    """Hazards of each answer, as kernels walk through them."""

    emergency: Any
    lasting: Any
    passing: Any


def chains_of(hazards: Iterable[Hazard]) -> HazardChains:
    """Convert the table for kernels: to a chain for each answer, in its order."""
    chains: dict[int, Any] = {EMERGENCY: NoHazard(), LASTS: NoHazard(), PASSES: NoHazard()}
    for hazard in reversed(tuple(hazards)):
        chains[hazard.answer] = hazard._replace(rest=chains[hazard.answer])
    return HazardChains(chains[EMERGENCY], chains[LASTS], chains[PASSES])


def by_code(hazards: Iterable[Hazard]) -> Mapping[int, Hazard]:
    """Index the rows by the codes in findings.

    Raises:
        ValueError: Two have the same code.
    """
    rows: dict[int, Hazard] = {}
    for hazard in hazards:
        for code in range(hazard.code, hazard.code + hazard.codes):
            if code == NOTHING or code in rows:
                raise ValueError(f"hazard {hazard.name!r} has the code {code}, which is taken")
            rows[code] = hazard
    return rows


HAZARD_CHAINS: Final = chains_of(HAZARDS)
