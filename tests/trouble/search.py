"""Trial of one case against all properties, and its shrinking to the shortest that still fails in the same way."""

import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

from tests.trouble.case import Case
from tests.trouble.drive import CaseDrive, Driven
from tests.trouble.properties import PROPERTIES, Trouble
from touchline.checking.check_session import check_recording
from touchline.schemas.errors import TouchlineError
from touchline.schemas.truth import Truth

OTHER_LOOK_TICKS: Final = 3
MOST_TRIALS: Final = 150
"""Trials of smaller cases while one is shrunk."""


def trouble_in(case: Case, *, recorded: bool = False) -> Trouble | None:
    """Drive a case, and return the first property that it breaks; None if it breaks none.

    Args:
        case: The case.
        recorded: Whether it is also driven twice more, at another pace and from its recording.
    """
    try:
        driven = _driven(case)
        if recorded:
            _check_recorded(case, driven)
    except Trouble as trouble:
        return trouble
    except TouchlineError as error:
        return Trouble("refused", str(error))
    except Exception as error:  # noqa: BLE001 - whatever it is, it is what was sought
        return Trouble(type(error).__name__, str(error))
    return None


def _driven(case: Case) -> Driven:
    properties = [kind(case) for kind in PROPERTIES]
    driven = CaseDrive(case).run(properties)
    for each in properties:
        each.end(driven)
    return driven


def _check_recorded(case: Case, driven: Driven) -> None:
    """Drive the case again with the same orders at the same ticks, recorded and at other looks; check the recording."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "case.mcap"
        recorded = CaseDrive(case, record=path, orders=driven.orders).run()
        again = CaseDrive(case, listened=True, orders=driven.orders, look_ticks=OTHER_LOOK_TICKS).run()
        if recorded.session_hash != again.session_hash:
            raise Trouble("SameHash", "the same case twice, at two paces, gives two hashes")
        alike = {"header": driven.report.header, "session_hash": driven.report.session_hash}
        if recorded.report.model_copy(update=alike) != driven.report:
            raise Trouble("SameReport", "recording changes the report")
        for session in check_recording(path):
            if not session.passed:
                raise Trouble("Check", session.problem or str(session.first))


def shrunk(case: Case, trouble: Trouble, *, recorded: bool = False) -> tuple[Case, Trouble]:
    """Return the smallest case found that breaks the same property, with its trouble."""
    trials, smaller = 0, True
    while smaller and trials < MOST_TRIALS:
        smaller = False
        for candidate in _smaller(case):
            trials += 1
            found = trouble_in(candidate, recorded=recorded)
            if found is not None and found.name == trouble.name:
                case, trouble, smaller = candidate, found, True
                break
            if trials >= MOST_TRIALS:
                break
    return case, trouble


def _smaller(case: Case) -> Iterator[Case]:
    """Cases with one thing less: an order, a fault, a line, a figure of the truth, the ground, the noise."""
    scenario = case.scenario
    for orders in _without_one(case.orders):
        yield case.model_copy(update={"orders": orders})
    for faults in _without_one(scenario.faults):
        yield case.with_scenario(faults=faults)
    for segments in _without_one(case.template.segments):
        if segments:
            yield case.model_copy(update={"template": case.template.model_copy(update={"segments": segments})})
    for name in sorted(scenario.truth.model_fields_set):
        rest: dict[str, Any] = scenario.truth.model_dump(exclude_defaults=True)
        rest.pop(name, None)
        yield case.with_scenario(truth=Truth(**rest))
    for name in ("ground", "multipath"):
        default = type(scenario).model_fields[name].default
        if getattr(scenario, name) != default:
            yield case.with_scenario(**{name: default})
    if scenario.noise == "default":
        yield case.with_scenario(noise="none")
    if case.patient:
        yield case.model_copy(update={"patient": False})
    if case.follower != "pure-pursuit":
        yield case.model_copy(update={"follower": "pure-pursuit"})


def _without_one(parts: tuple[Any, ...]) -> Iterator[tuple[Any, ...]]:
    for i in range(len(parts)):
        yield parts[:i] + parts[i + 1 :]
