"""Cases of a sweep as the command line's texts make them."""

from touchline.schemas.messages import PlanOptions
from touchline.schemas.scenario import Scenario
from touchline.services.runs.sweep.combinations import cases, parse_settings


def combined(*texts, scenario=None, work="study-square"):
    return cases(work, scenario or Scenario(), PlanOptions(), parse_settings(texts))
