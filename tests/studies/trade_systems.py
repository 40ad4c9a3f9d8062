"""Scenes whose costs and errors are compared, and points that were made up."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lagrange_cli import loads
from lagrange_cli.simulate.accuracy.method_selection import coarse_result
from lagrange_cli.simulate.checkpoint.progress import Watch
from lagrange_cli.simulate.model.build import model_of
from lagrange_cli.simulate.options import SimulationOptions
from lagrange_cli.simulate.request import resolve
from lagrange_cli.simulate.simulation import problem_of
from lagrange_cli.simulate.system.functions import right_hand_side
from lagrange_cli.studies.tradeoff.runs import Setting, WorkPrecisionPoint

OSCILLATOR = """
name: oscillator
particles: {m: {mass: 1, position: [x, 0, 0]}}
coordinates: [x]
potentials: {spring: x^2/2}
initial: {x: 1}
simulate: {until: 6, samples: 61}
"""

PENDULUM = """
name: pendulum
parameters: {m: 1, l: 1, g: 9.81}
particles: {bob: {mass: m, position: [x, 0, z]}}
FORM
potentials: {weight: m*g*z}
simulate: {until: 2, samples: 41}
"""

ANGLE = """
coordinates: [theta]
definitions: {x: l*sin(theta), z: -l*cos(theta)}
initial: {theta: 1}
"""

ROD = """
constraints: {rod: x^2 + z^2 = l^2}
coordinates: [x, z]
initial: {x: sin(1), z: -cos(1)}
"""

BALL = """
name: ball
parameters: {g: 10, e: 0.5}
plane: xz
particles: {ball: {mass: 1, position: [x, y, z]}}
constraints: {floor: {unilateral: z >= 0, restitution: e}}
potentials: {weight: {gravity: g}}
initial: {x: 0, z: 5, dot(x): 1}
simulate: {until: 2.4, samples: 25}
"""

DOUBLE = """
name: double
parameters: {g: 9.81}
particles:
  a: {mass: 1, position: [sin(p), 0, -cos(p)]}
  b: {mass: 1, position: [sin(p) + sin(q), 0, -cos(p) - cos(q)]}
coordinates: [p, q]
potentials: {weight: {gravity: g}}
initial: {p: 1.5, q: 2}
simulate: {until: 70, samples: 141}
"""

STIFF = """
name: stiff
particles: {m: {mass: 1, position: [x, 0, 0]}}
coordinates: [x]
potentials: {spring: x^2/2}
dissipation: {drag: 1e4*dot(x)^2/2}
initial: {x: 1}
simulate: {until: 9, samples: 11}
"""

RUNAWAY = """
name: runaway
particles: {m: {mass: 1, position: [x, 0, 0]}}
coordinates: [x]
potentials: {hill: -x^4/2}
initial: {x: 1, dot(x): 1}
simulate: {until: 2, samples: 21}
"""


def model(scene, form=""):
    return model_of(loads(scene.replace("FORM", form)).derive().equations)


def problem_and_coarse_run(system, until=None):
    request = resolve(system, SimulationOptions(method="DOP853", rtol=1e-6, until=until))
    functions = right_hand_side(system)
    problem = problem_of(system, request, functions)
    with np.errstate(all="ignore"):
        return request, functions, problem, coarse_result(problem, 1e-9, Watch())


def made(error, seconds=1.0, method="DOP853", evaluations=100, **more):
    """A point that was made up."""
    outcome = "ok" if error is not None else "failed"
    given_seconds = (seconds,) if error is not None else ()
    setting = Setting(method, rtol=1e-6)
    point = WorkPrecisionPoint(
        setting, outcome, "", error, True, 9, evaluations, None, given_seconds, spent=seconds
    )
    return replace(point, **more)
