"""Sessions do not depend on how a version of Python adds numbers."""

import json
import subprocess
import sys

from tests.api.test_simulated import HASH
from touchline.core.plain_sum import plain_sum

COMPENSATED = """
import builtins, math, sys

def compensated(values, start=0, plain=sum):
    values = list(values)
    exact = not start and any(type(each) is float for each in values)
    return math.fsum(values) if exact else plain(values, start)

builtins.sum = compensated
sys.argv[1:] = ["simulate", "study-square", "--hash", "--json"]
from touchline.cli import main

main()
"""


def test_numbers_are_added_one_after_another() -> None:
    assert plain_sum([0.1] * 10) == 0.1 + 0.1 + 0.1 + 0.1 + 0.1 + 0.1 + 0.1 + 0.1 + 0.1 + 0.1 != 1.0
    assert plain_sum([]) == 0.0


def test_a_session_is_the_same_where_sum_compensates_as_from_python_3_12_on() -> None:
    done = subprocess.run([sys.executable, "-c", COMPENSATED], capture_output=True, text=True, check=True)
    assert json.loads(done.stdout)["hash"]["session"] == HASH
