"""DC motor behind a gear with its amplifier, a speed profile and a speed controller, as the wheel feels them.

The motor is the usual equivalent circuit, torque k·i and voltage R·i + k·ω, without inductance (G. F. Franklin, J. D.
Powell, A. Emami-Naeini, "Feedback Control of Dynamic Systems", 7th ed., sec. 2.3): the current loop is a first-order
lag instead. The controller's integral stands still while the torque is limited (conditional integration: K. J. Åström,
T. Hägglund, "PID Controllers", 2nd ed., sec. 3.5).
"""

from __future__ import annotations

from typing import NamedTuple

from touchline.core.jit import kernel
from touchline.schemas.vehicles.differential_drive import Motor
from touchline.services.robot_sim.world.body import STEP_S
from touchline.services.robot_sim.world.lag import share_per_step

_DRY_RADPS = 0.05  # dry friction is drag below this rate


class DcMotor(NamedTuple):
    """Parameters at the wheel.

    Attributes:
        torque_per_a: Nm/A, less gear losses.
        emf: V per rad/s.
        resistance_ohm: Resistance of the winding.
        most_nm: Largest torque, by the amplifier's current, unless the motor is weak.
        current_lag: Share of the way to the demanded torque in one step.
        gain: Gain of the controller, Nm per rad/s.
        integral_gain: Integral gain, Nm per rad.
        integral_limit_nm: Limit of the integral.
    """

    torque_per_a: float
    emf: float
    resistance_ohm: float
    most_nm: float
    current_lag: float
    gain: float
    integral_gain: float
    integral_limit_nm: float


def dc_motor(
    motor: Motor, current_lag_s: float, gain: float, integral_s: float, integral_limit_nm: float | None = None
) -> DcMotor:
    """Make a motor behind its gear, with the PI controller of its speed.

    Args:
        motor: Motor as in the vehicle's file.
        current_lag_s: Time constant of the current loop.
        gain: Gain of the controller, Nm per rad/s.
        integral_s: Its integral time.
        integral_limit_nm: Limit of the integral; None: the motor's torque.
    """
    emf = motor.constant_nm_per_a * motor.gear_ratio
    torque_per_a = emf * motor.gear_efficiency
    most_nm = torque_per_a * motor.max_current_a
    limit_nm = most_nm if integral_limit_nm is None else integral_limit_nm
    current_lag = share_per_step(current_lag_s)
    return DcMotor(torque_per_a, emf, motor.resistance_ohm, most_nm, current_lag, gain, gain / integral_s, limit_nm)


class MotorState(NamedTuple):
    """Rate of the wheel [rad/s], torque of the motor and integral of its controller [Nm]."""

    rate: float
    torque: float
    integral: float


@kernel
def profile(reference: float, command: float, most: float, lag: float, step: float) -> float:
    """Compute the reference a step later: a first-order lag to the command, within limits of rate and acceleration.

    Args:
        reference: Present reference [rad/s].
        command: Command to follow [rad/s].
        most: Largest rate [rad/s].
        lag: Share of the way to the command in one step.
        step: Largest change in one step [rad/s].
    """
    target = min(max(command, -most), most)
    stepped: float = reference + min(max((target - reference) * lag, -step), step)
    return stepped


@kernel
def drag(rate: float, viscous: float, friction: float) -> float:
    """Compute the friction of motor and gear [Nm per rad/s]: dry (Coulomb) and viscous.

    Args:
        rate: Rate of the wheel [rad/s].
        viscous: Viscous friction, Nm per rad/s.
        friction: Dry friction [Nm].
    """
    coefficient: float = viscous + friction / max(abs(rate), _DRY_RADPS)
    return coefficient


@kernel
def follow(
    motor: DcMotor, now: MotorState, reference: float, ahead: float, voltage: float, share: float
) -> tuple[float, float, float]:
    """Compute one step of controller and motor; an empty battery gives nothing.

    Args:
        motor: Parameters of the motor.
        now: State at the start of the step.
        reference: Wanted rate of the wheel [rad/s].
        ahead: Feed-forward of inertia and friction [Nm].
        voltage: Voltage of the battery [V]; 0 if it is empty.
        share: Share of its largest torque that the motor has.

    Returns:
        Torque and integral at the step's end [Nm], and the electrical power drawn [W], negative if it is returned.
    """
    error = reference - now.rate
    wanted = ahead + motor.gain * error + now.integral
    back = motor.emf * now.rate
    per_volt = motor.torque_per_a / motor.resistance_ohm
    most = motor.most_nm * share
    upper = max(min(most, per_volt * (voltage - back)), 0.0) if voltage > 0.0 else 0.0
    lower = min(max(-most, per_volt * (-voltage - back)), 0.0) if voltage > 0.0 else 0.0
    limited = min(max(wanted, lower), upper)
    integral = now.integral
    if limited == wanted:  # else the integral would wind up
        integral += motor.integral_gain * error * STEP_S
        integral = min(max(integral, -motor.integral_limit_nm), motor.integral_limit_nm)
    torque = now.torque + (limited - now.torque) * motor.current_lag
    current = torque / motor.torque_per_a
    return torque, integral, current * current * motor.resistance_ohm + back * current
