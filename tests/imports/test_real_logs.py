"""Reduced logs of real robots: the estimator's figures on them stay within the bounds of the baseline."""

import json
from functools import reduce
from pathlib import Path

import pytest

from touchline.checking.estimating.estimator_inputs import EstimatorInputs
from touchline.checking.estimating.log_figures import estimate_log
from touchline.checking.importing.import_logs import import_logs, load_mapping

LOGS = Path(__file__).parents[1] / "logs"
MAPPINGS = {
    "plaza1": LOGS.parents[1] / "examples" / "imports" / "plaza1.json",
    "husky": LOGS / "husky.json",
    "f9p": LOGS / "f9p.json",
}
BASELINE = json.loads((LOGS / "baseline.json").read_text())


@pytest.mark.parametrize("name", MAPPINGS)
def test_figures_stay_within_their_bounds(name, tmp_path):
    out = tmp_path / "session.mcap"
    import_logs(sorted(LOGS.glob(f"{name}_*.csv")), load_mapping(MAPPINGS[name]), out)
    inputs = EstimatorInputs(out, None)
    _, figures = estimate_log(inputs, inputs.setup)
    found = {path: reduce(lambda part, key: part[key], path.split("."), figures) for path in BASELINE[name]}
    outside = {path: found[path] for path, (low, high) in BASELINE[name].items() if not low <= found[path] <= high}
    assert not outside
