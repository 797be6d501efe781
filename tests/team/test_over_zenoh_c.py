"""The example in C answers the coordinator's questions; only where a C compiler finds zenoh-pico (CPATH, LIBRARY_PATH).

zenoh-pico is in no package registry of Python, so most machines skip this.
"""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.meeting import eventually
from touchline.bus import Bus, BusConfig
from touchline.schemas import topics
from touchline.schemas.messages import String

SOURCE = Path(__file__).resolve().parents[2] / "examples" / "teams" / "over_zenoh.c"
LINKED = ("-DZENOH_LINUX", "-lzenohpico", "-lpthread", "-lm")
ASKED = {
    "update": 12,
    "name": "a",
    "x_m": 1.0,
    "y_m": 2.0,
    "heard": [{"from": "b", "age_s": 0.4, "text": "[2.0, 0.4]"}],
}


@pytest.fixture
def program(tmp_path: Path) -> Path:
    """Return the compiled example."""
    if (compiler := shutil.which("cc")) is None:
        pytest.skip("there is no C compiler")
    probe, made = tmp_path / "probe.c", tmp_path / "over_zenoh"
    probe.write_text("#include <zenoh-pico.h>\nint main(void) { return 0; }\n")
    command = (compiler, "-o", str(made))
    if subprocess.run((*command, str(probe), *LINKED), capture_output=True, check=False).returncode:
        pytest.skip("the compiler does not find zenoh-pico")
    subprocess.run((*command, str(SOURCE), *LINKED), check=True)
    return made


def test_it_wishes_to_drive_half_of_the_way_to_whom_it_hears(program: Path, bus_config: BusConfig) -> None:
    with Bus.open(topics.COORDINATOR, bus_config) as bus:
        question, answers = bus.of("a").publisher(topics.ALGORITHM_STATE), bus.of("a").inbox([topics.ALGORITHM_WISH])
        heard = list[str]()

        def answered() -> bool:
            question.send(String(data=json.dumps(ASKED)))  # it may not have joined yet
            heard.extend(message.data for _, message in answers.messages() if isinstance(message, String))
            return bool(heard)

        with subprocess.Popen((str(program), bus_config.endpoint, "a")) as other:
            try:
                assert eventually(answered)
            finally:
                other.kill()
    wish = json.loads(heard[0])
    assert wish == {"update": 12, "wish": {"velocity": [0.5, -0.8]}, "say": "[1.000000, 2.000000]"}
