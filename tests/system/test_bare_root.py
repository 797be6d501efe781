"""The guide to several machines, followed in a bare Debian that systemd-nspawn boots: its commands and its units."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from urllib.request import urlopen

import pytest

ROOT = Path(__file__).parents[2]
GUIDE = (ROOT / "docs" / "guides" / "several-machines.md").read_text(encoding="utf-8")
UNITS = ("touchline-router", "touchline-planner", "touchline-bridge", "touchline-robot@r1", "touchline-robot@r2")
#: Packages besides Debian's essential ones; the guide's own `apt-get install` then needs no network.
PACKAGES = "systemd-sysv,python3-venv"
#: A boot, or a service that has been killed: its kernels are in the wheel.
STARTED_S = 300.0


def commands(heading: str) -> list[str]:
    """Shell blocks below a heading of the guide."""
    section = re.search(rf"^## {heading}\n(.*?)(?=^## )", GUIDE, re.M | re.S)
    assert section is not None
    return re.findall(r"^```sh\n(.*?)^```", section[1], re.M | re.S)


def mirror() -> str:
    """Debian mirror that this machine's apt uses."""
    form = ["--format", "$(ORIGIN) $(COMPONENT) $(REPO_URI)", "Created-By: Packages"]
    told = subprocess.run(["apt-get", "indextargets", *form], capture_output=True, text=True, check=True).stdout
    found = re.search(r"^Debian main (http\S+)$", told, re.M)
    if found is None:
        pytest.skip("apt has no mirror of Debian")
    try:
        urlopen(f"{found[1]}dists/bookworm/InRelease", timeout=30.0).close()
    except OSError as error:
        pytest.skip(f"the mirror of Debian cannot be reached: {error}")
    return found[1]


def make_wheels(folder: Path) -> None:
    """Make our wheel as `make wheel` does, from a copy of the checkout, and fetch those that it needs."""
    copy, pip = folder / "checkout", [sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check"]
    shutil.copytree(ROOT, copy, ignore=shutil.ignore_patterns(".*", "build", "dist", "*.egg-info"))
    subprocess.run([sys.executable, ROOT / "kernels.py", copy / "build" / "kernels"], cwd=folder, check=True)
    subprocess.run([*pip, "wheel", "--no-deps", "--wheel-dir", folder / "dist", copy], check=True)
    [wheel] = (folder / "dist").iterdir()
    extras = re.search(r"touchline-\*\.whl\)(\[.*?\])", GUIDE)
    assert extras is not None
    only = ["--only-binary", ":all:", "--python-version", "3.11"]
    constraints = ["--constraint", ROOT / "constraints.txt", "--dest", folder / "wheels"]
    subprocess.run([*pip, "download", *only, *constraints, f"{wheel}{extras[1]}"], check=True)


class Machine:
    """Booted container with a network of its own."""

    def __init__(self, root: Path) -> None:
        command = ["systemd-nspawn", "--quiet", "--directory", root, "--boot", "--private-network"]
        alone = ["--register=no", "--keep-unit", "--console=pipe"]
        self._console = (root.parent / "console").open("wb")
        self.process = subprocess.Popen([*command, *alone], stdin=subprocess.DEVNULL, stdout=self._console)
        wait_for(lambda: bool(self._init()), "the container has not started")
        wait_for(lambda: self.run("systemctl is-system-running").stdout.strip() in {"running", "degraded"}, "no boot")

    def _init(self) -> str:
        """Process id of its init."""
        assert self.process.poll() is None, "systemd-nspawn has ended"
        return Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children").read_text().strip()

    def run(self, script: str, **variables: str) -> "subprocess.CompletedProcess[str]":
        """Run a shell script as root, in the folder of the wheel."""
        told = {
            "PATH": "/opt/touchline/bin:/usr/sbin:/usr/bin:/sbin:/bin",
            "HOME": "/root",
            "COLUMNS": "200",
            **variables,
        }
        inside = ["nsenter", f"--target={self._init()}", "--all", "sh", "-ec", f"cd /root/dist\n{script}"]
        return subprocess.run(inside, env=told, capture_output=True, text=True, check=False, timeout=600.0)

    def done(self, script: str, **variables: str) -> str:
        """Output of a shell script that must succeed."""
        ran = self.run(script, **variables)
        assert ran.returncode == 0, f"{script}{ran.stdout}{ran.stderr}"
        return ran.stdout

    def shown(self, unit: str) -> dict[str, str]:
        """State of a unit."""
        names = "ActiveState,MainPID,NRestarts"
        return dict(line.split("=", 1) for line in self.done(f"systemctl show -p {names} {unit}").splitlines())

    def journal(self, unit: str) -> list[dict[str, str]]:
        """Entries of a unit's journal, those of the service manager about it included."""
        return [json.loads(line) for line in self.done(f"journalctl -u {unit} -o json").splitlines()]

    def shut_down(self) -> None:
        """Stop all units, as a machine that is switched off does."""
        self.process.send_signal(signal.SIGTERM)
        with suppress(subprocess.TimeoutExpired):
            self.process.wait(120.0)
        self.process.kill()
        self.process.wait()
        self._console.close()


def wait_for(condition: Callable[[], bool], why: str) -> None:
    until_s = time.monotonic() + STARTED_S
    while not condition():
        assert time.monotonic() < until_s, why
        time.sleep(0.2)


@pytest.fixture
def machine(tmp_path: Path) -> Iterator[Machine]:
    if missing := [each for each in ("debootstrap", "systemd-nspawn", "nsenter", "ip") if shutil.which(each) is None]:
        pytest.skip(f"no {', '.join(missing)}: apt-get install debootstrap systemd-container util-linux iproute2")
    if os.geteuid() != 0:
        pytest.skip("only root can boot a container")
    root, made_from = tmp_path / "root", mirror()
    try:
        bare = ["debootstrap", "--variant=minbase", f"--include={PACKAGES}", "bookworm", root, made_from]
        subprocess.run(bare, check=True, stdout=subprocess.DEVNULL)
        make_wheels(tmp_path)
        for folder in ("dist", "wheels"):
            shutil.move(tmp_path / folder, root / "root" / folder)
        booted = Machine(root)
        try:
            yield booted
        finally:
            booted.shut_down()
    finally:
        shutil.rmtree(root, ignore_errors=True)  # more than a gigabyte


@pytest.mark.full
@pytest.mark.timeout(3600)
def test_a_bare_machine_runs_the_units_after_the_guide(machine: Machine) -> None:
    install, issue, place, enable = commands("Install")
    machine.done(install, PIP_NO_INDEX="1", PIP_FIND_LINKS="/root/wheels")
    machine.done(issue)
    machine.done(place.replace("bridge.main", "bridge.main robot.r1 robot.r2"))
    machine.done("systemctl log-level warning")
    network = ["nsenter", f"--target={machine._init()}", "--net"]
    for address in re.findall(r"(?:tls/|--host )(10[\d.]+)", issue):
        subprocess.run([*network, "ip", "address", "add", f"{address}/24", "dev", "lo"], check=True)
    machine.done(enable + "systemctl enable --now touchline-robot@r2")
    assert [machine.shown(unit)["ActiveState"] for unit in UNITS] == ["active"] * len(UNITS)

    [operate] = commands("Operate")
    said = machine.done(operate)
    assert {"r1", "r2"} <= set(re.findall(r"\w+", said)), said
    assert set(re.findall(r"^(\w+): estop: done$", said, re.M)) == {"r1", "r2"}, said

    for unit, how in (("touchline-planner", "KILL"), ("touchline-robot@r1", "STOP")):
        before = machine.shown(unit)
        assert before["NRestarts"] == "0"
        machine.done(f"kill -s {how} {before['MainPID']}")

        def restarted(unit: str = unit) -> bool:
            shown = machine.shown(unit)
            return shown["ActiveState"] == "active" and shown["NRestarts"] == "1"

        wait_for(restarted, f"{unit} is not restarted")
        entries = machine.journal(unit)
        own = [entry for entry in entries if entry.get("SYSLOG_IDENTIFIER") == unit]
        assert {before["MainPID"], machine.shown(unit)["MainPID"]} <= {entry["_PID"] for entry in own}
    assert any("Watchdog timeout" in entry["MESSAGE"] for entry in entries)
    assert {"r1", "r2"} <= set(re.findall(r"\w+", machine.done(operate.partition("touchline run")[0])))
