"""Limits of committed plans, of small robots that hear of their plans at once."""

from touchline.coordination.plans.plan_kernels import PlanLimits

LIMITS = PlanLimits(
    speed_max_mps=0.5,
    acceleration_mps2=0.5,
    lateral_acceleration_mps2=0.5,
    yaw_rate_max_radps=2.0,
    yaw_acceleration_radps2=4.0,
    apart_m=0.4,
    wall_m=0.2,
    lead_steps=0,
    drive_steps=8,
    update_steps=8,
)
