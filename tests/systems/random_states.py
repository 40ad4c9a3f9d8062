"""Random scenes with states of first order, and their equations by another way.

The same texts are read by SymPy, which differentiates the Lagrangian with the states held: Newton's
equations, rates and their derivatives are evaluated by NumPy, and nothing of the program is used.
"""

from __future__ import annotations

import random
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import sympy as sp
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

Array = NDArray[np.float64]

#: End of motions.
UNTIL = 3.0


@dataclass(frozen=True)
class RandomScene:
    """A scene as texts: its sections, in the language of scenes."""

    name: str
    parameters: dict[str, float]
    coordinates: tuple[str, ...]
    kinetic: str
    potential: str
    dissipation: str
    forces: dict[str, str]
    rates: dict[str, str]
    inputs: dict[str, str]
    start: tuple[float, ...]

    @property
    def text(self) -> str:
        """The scene as a file has it."""
        state_names = (*self.coordinates, *(f"dot({q})" for q in self.coordinates), *self.rates)
        initial = dict(zip(state_names, self.start, strict=True))
        forces = {f"on_{q}": f"{{on: {q}, force: '{text}'}}" for q, text in self.forces.items()}
        lines = [
            f"name: {self.name}",
            f"parameters: {_mapping(self.parameters)}",
            f"coordinates: [{', '.join(self.coordinates)}]",
            *([f"inputs: {_quoted(self.inputs)}"] if self.inputs else []),
            f"kinetic: {{all: '{self.kinetic}'}}",
            f"potentials: {{all: '{self.potential}'}}",
            f"dissipation: {{all: '{self.dissipation}'}}",
            f"forces: {_mapping(forces)}",
            f"states: {_quoted(self.rates)}",
            f"initial: {_mapping(initial)}",
            f"simulate: {{until: {UNTIL}, samples: 31}}",
        ]
        return "\n".join(lines) + "\n"


def _mapping(entries: dict[str, object]) -> str:
    return "{" + ", ".join(f"{name}: {value}" for name, value in entries.items()) + "}"


def _quoted(entries: dict[str, str]) -> str:
    return _mapping({name: f"'{text}'" for name, text in entries.items()})


def random_scene(seed: int) -> RandomScene:
    """One or two coordinates, one to three states, and an input in every other scene."""
    choose = random.Random(seed)
    n, k = choose.randint(1, 2), choose.randint(1, 3)
    q, s = tuple(f"q{i}" for i in range(1, n + 1)), tuple(f"s{j}" for j in range(1, k + 1))
    parameters = {name: round(choose.uniform(0.4, 2.0), 3) for name in "abcdkmw"}
    inputs = {"u": choose.choice(["a*sin(w*t)", "b*cos(w*t) - a", "c*exp(-t)"])}
    inputs = inputs if choose.random() < 0.5 else {}
    driven = ["u", "a"] if inputs else ["a"]

    def kinetic(i: int) -> str:
        squares = [f"m*dot({q[i]})^2/2", f"(m + a*cos({q[i]})^2)*dot({q[i]})^2/2"]
        return choose.choice(squares)

    def spring(i: int) -> str:
        forms = ["k*{q}^2/2", "k*({q} - {s})^2/2", "-k*cos({q})", "k*{q}^2/2 + b*{q}^4/4"]
        return choose.choice([*forms, "k*sqrt(1 + {q}^2)"]).format(q=q[i], s=choose.choice(s))

    def force(i: int) -> str:
        forms = [
            "c*{s}",
            "b*{s}*cos({q})",
            "-a*tanh({s}*dot({q}))",
            "{u} - c*{s}",
            "d*{s}/(1 + {q}^2)",
        ]
        return choose.choice(forms).format(q=q[i], s=choose.choice(s), u=choose.choice(driven))

    def rate(j: int) -> str:
        forms = [
            "({q} - {s})/a",
            "({u} - {s} - b*dot({q}))/c",
            "k*dot({q}) - {s}/a",
            "tanh({q}) - b*{s}",
            "{r}*cos({q}) - {s} - {s}^3",
            "{u}*exp(-{q}^2) - c*{s}",
            "d - {q}",
            "sin({r}) - {s}*(1 + dot({q})^2)",
        ]
        other, moving = choose.choice(s), choose.choice(q)
        return choose.choice(forms).format(q=moving, s=s[j], r=other, u=choose.choice(driven))

    terms = [kinetic(i) for i in range(n)]
    if n == 2 and choose.random() < 0.5:
        terms.append("m*dot(q1)*dot(q2)*cos(q1 - q2)/4")
    pairs = ["a*(q1 - q2)^2/2"] if n == 2 else []
    return RandomScene(
        f"states_{seed}",
        parameters,
        q,
        " + ".join(terms),
        " + ".join([*(spring(i) for i in range(n)), *pairs]),
        " + ".join(f"d*dot({name})^2/2" for name in q),
        {name: force(i) for i, name in enumerate(q) if choose.random() < 0.8} or {q[0]: force(0)},
        {name: rate(j) for j, name in enumerate(s)},
        inputs,
        tuple(round(choose.uniform(-0.8, 0.8), 3) for _ in range(2 * n + k)),
    )


class Reference:
    """Rates of y = [q, q̇, s] of a scene, and their derivatives, from SymPy's reading of it."""

    def __init__(self, scene: RandomScene) -> None:
        self.scene = scene
        names = [*scene.parameters, *scene.coordinates, *scene.rates, *scene.inputs, "t"]
        self._symbols = {name: sp.Symbol(name, real=True) for name in names}
        self._rates = [sp.Symbol(f"d{name}", real=True) for name in scene.coordinates]

    def _read(self, text: str) -> sp.Expr:
        for name, rate in zip(self.scene.coordinates, self._rates, strict=True):
            text = text.replace(f"dot({name})", str(rate))
        known = self._symbols | {str(rate): rate for rate in self._rates}
        return sp.sympify(text.replace("^", "**"), locals=known)

    @cached_property
    def _right(self) -> sp.Matrix:
        scene, v = self.scene, sp.Matrix(self._rates)
        q = sp.Matrix([self._symbols[name] for name in scene.coordinates])
        lagrangian = self._read(scene.kinetic) - self._read(scene.potential)
        momenta = sp.Matrix([lagrangian]).jacobian(v)
        force = sp.Matrix([self._read(scene.forces.get(name, "0")) for name in scene.coordinates])
        force += sp.Matrix([lagrangian]).jacobian(q).T
        force -= sp.Matrix([self._read(scene.dissipation)]).jacobian(v).T
        accelerations = momenta.jacobian(v).LUsolve(force - momenta.jacobian(q) * v)
        return sp.Matrix([*v, *accelerations, *map(self._read, scene.rates.values())])

    @cached_property
    def _inputs(self) -> list[sp.Expr]:
        return [self._read(text) for text in self.scene.inputs.values()]

    def _function(self, matrix: sp.Matrix, *, driven: bool):
        given = {
            self._symbols[name]: x for name, x in zip(self.scene.inputs, self._inputs, strict=True)
        }
        whole = matrix if driven else matrix.subs(given)
        p, u = (
            [self._symbols[name] for name in part]
            for part in (self.scene.parameters, self.scene.inputs)
        )
        return sp.lambdify([self._symbols["t"], self._state, p, u], whole, "numpy", cse=True)

    @cached_property
    def _state(self) -> list[sp.Symbol]:
        names = self._symbols
        q, s = (
            [names[name] for name in part] for part in (self.scene.coordinates, self.scene.rates)
        )
        return [*q, *self._rates, *s]

    @cached_property
    def _values(self):
        right = self._right
        by_inputs = right.jacobian(
            [self._symbols[name] for name in self.scene.inputs] or [sp.Dummy()]
        )
        jacobians = {"jacobian": right.jacobian(self._state), "jacobian_u": by_inputs}
        return {
            name: self._function(m, driven=True) for name, m in {"rhs": right, **jacobians}.items()
        }

    def value(self, what: str, t: float, y: Array, u: Array) -> Array:
        """Evaluate ``rhs``, ``jacobian`` or ``jacobian_u`` with given inputs."""
        p = list(self.scene.parameters.values())
        found = np.array(self._values[what](t, y, p, u), dtype=float)
        return found.ravel() if what == "rhs" else found

    def motion(self, times: Array) -> Array:
        """Integrate by SciPy's DOP853 at its tightest; shape (states, times)."""
        rates = self._function(self._right, driven=False)
        p, none = list(self.scene.parameters.values()), [0.0] * len(self.scene.inputs)
        solution = solve_ivp(
            lambda t, y: rates(t, y, p, none).ravel(),
            (times[0], times[-1]),
            self.scene.start,
            method="DOP853",
            t_eval=times,
            rtol=2.3e-14,
            atol=1e-16,
        )
        assert solution.success, solution.message
        return np.asarray(solution.y)
