"""Cases of a sweep as the command line's texts make them."""

from touchline.jobs.sweep.combinations import cases, parse_settings
from touchline.schemas.messages import PlanOptions
from touchline.schemas.scenario import Scenario


def combined(*texts, scenario=None, work="study-square"):
    return cases(work, scenario or Scenario(), PlanOptions(), parse_settings(texts))
