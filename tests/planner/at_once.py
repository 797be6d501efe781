"""Plans for tests that ask nothing of the order: the first one found will do."""

from touchline.schemas.messages import PlanOptions
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.plan import Plan, plan


def planned_at_once(template: Template, options: PlanOptions | None = None) -> Plan:
    """The plan of the shipped robot; an order is searched for, but no longer than it takes to find one."""
    return plan(template, Vehicle(), options, enough=lambda: True)
