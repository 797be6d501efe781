"""Cases of a sweep as the command line's texts make them."""

from touchline.schemas.messages import PlanOptions
from touchline.schemas.scenario import Scenario
from touchline.services.runs.sweep.combinations import cases, parse_settings


def combined(*texts, scenario=None):
    return cases("study-square", scenario or Scenario(), PlanOptions(), parse_settings(texts))
