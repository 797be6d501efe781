"""Every benchmark, run small, prints what it declares and nothing that speaks of trouble."""

import re

import pytest

from benchmarks._settings import NotHereError, available, benchmark, parsed

NUMBER = r"[-+]?\d[\d,]*(\.\d+)?(e[-+]?\d+)?"
TROUBLE = re.compile(
    r"\b(nan|inf|BAD|MISSED|WARN\w*|ERROR|\w*Error|\w*Warning|warning|Traceback)\b"
    r"|no topic of ours|in the recording:|^error: |lost: (?!nothing)|no refill|a new system"
)
BUSY = re.compile(r"still trying|the control loop did not turn")
"""Lines that are due where much else is done beside."""


def as_pattern(line: str) -> re.Pattern[str]:
    """A declared line: # stands for a number, a blank for any number of them."""
    return re.compile(r"\s*".join(re.escape(word).replace(r"\#", NUMBER) for word in line.split()))


def troubled(text: str) -> list[str]:
    """Lines of a text that speak of trouble."""
    return [line for line in text.splitlines() if TROUBLE.search(line) and not BUSY.search(line)]


def without(lines: tuple[str, ...], text: str) -> list[str]:
    """Declared lines that are not in a text."""
    return [line for line in lines if not as_pattern(line).search(text)]


LONG = frozenset(
    (
        *(
            "accuracy",
            "barriers",
            "calibration",
            "calibration_drive",
            "clear_away",
            "estimator",
            "fleet_recorded",
            "foxglove_cost",
            "joints",
            "kills",
            "lidar",
            "names",
            "poses",
        ),
        *("protection", "random_fields", "region_processes", "routes", "shared", "simulate", "soak", "steering"),
        *("stops", "system", "takeovers", "team_algorithms", "team_passages", "timelines"),
    )
)
"""Those of more than two seconds."""


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.full) if name in LONG else name for name in available()]
)
def test_a_small_run(name, capfd):
    try:
        module = benchmark(name)
        module.main(**module.SMALL.settings)
    except NotHereError as reason:
        pytest.skip(str(reason))
    text, messages = capfd.readouterr()
    assert without(module.SMALL.lines, text) == [], text
    assert troubled(text + messages) == []


def test_what_is_declared_is_looked_for():
    line = "idle # ms # %"
    assert without((line,), "idle          12 ms    1,234.5e-3 %") == []
    assert without((line,), "idle          nan ms    3 %") == [line]
    assert without((line,), "idle          12 s    3 %") == [line]


@pytest.mark.parametrize("line", ["/tt2/tf: no topic of ours", "RuntimeWarning: mean of empty slice", "p95 nan mm"])
def test_trouble_is_found(line):
    assert troubled(f"all is well\n{line}\n") == [line]


def test_settings_are_those_of_main():
    module = benchmark("safety")
    assert parsed(module, ["runs=3"]) == {"runs": 3}
    with pytest.raises(ValueError, match="no setting robots; there are: runs=200"):
        parsed(module, ["robots=3"])
    with pytest.raises(ValueError, match="runs=many"):
        parsed(module, ["runs=many"])


def test_a_missing_package_is_a_reason(monkeypatch):
    def import_module(name):
        raise ModuleNotFoundError(name="websockets.exceptions")

    monkeypatch.setattr("benchmarks._settings.importlib.import_module", import_module)
    with pytest.raises(NotHereError, match="the package websockets is not installed"):
        benchmark("foxglove_cost")
