"""Rates of the scenes with states of first order, typed by hand: [q̇, q̈, ṡ] of [q, q̇, s]."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Names = SimpleNamespace


def _motor(p: Names, t: float, y: Array) -> list[float]:
    phi, omega, i = y
    torque = p.K * i - p.b * omega - p.m * p.g * p.l * np.sin(phi)
    return [omega, torque / (p.m * p.l**2 + p.I), (p.V - p.R * i - p.K * omega) / p.L]


def _muscle(p: Names, t: float, y: Array) -> list[float]:
    _, v, a = y
    force = a * 2 * p.m * p.g * (1 - v / p.V) / (1 + v / (p.q * p.V))
    return [v, force / p.m - p.g, (1 - a) / p.T]


def _kelvin_voigt(p: Names, t: float, y: Array) -> list[float]:
    x, v, e = y
    force = p.K * (x - e)
    return [v, -force / p.m, (force - p.k * e) / p.c]


def _filter(p: Names, t: float, y: Array) -> list[float]:
    x, v, reading = y
    return [v, -p.k / p.m * x, (x - reading) / p.T]


def _maxwell(p: Names, t: float, y: Array) -> list[float]:
    _, v, force = y
    return [v, -force / p.m, p.k * (v - force / p.c)]


def _arm(p: Names, t: float, y: Array) -> list[float]:
    theta, omega, z, f = y
    torque = p.kp * (p.target - theta) + p.ki * z - p.kd * (theta - f) / p.T
    fall = p.g / p.l * np.cos(theta)
    return [omega, torque / (p.m * p.l**2) - fall, p.target - theta, (theta - f) / p.T]


def _solid(p: Names, t: float, y: Array) -> list[float]:
    x, v, force = y
    return [v, -(p.k * x + force) / p.m, p.K * v - force / p.T]


RATES: dict[str, Callable[[Names, float, Array], list[float]]] = {
    "dc_motor_pendulum": _motor,
    "hill_muscle": _muscle,
    "kelvin_voigt_element": _kelvin_voigt,
    "low_pass_filter": _filter,
    "maxwell_element": _maxwell,
    "pid_arm": _arm,
    "standard_linear_solid": _solid,
}
