"""Names of a scene as identifiers of Python."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from lagrange_cli.emit.naming import PYTHON_RESERVED, input_identifier, unique_identifiers

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

#: Names that functions of an emitted module use and that no name of a scene may hide.
_USED = frozenset(
    {"t", "y", "p", "u", "np", "jnp", "jax", "casadi", "out", "dydt", "mode", "targets"}
    | {"range", "any", "rhs", "flight", "multipliers", "inputs"}
    | {"solve", "solve_definite", "solve_banded", "solve_sparse"}
)

#: Names of counters, as far as a scene leaves them.
_COUNTERS = "ijklabcdefgh"


@dataclass(frozen=True)
class SceneNames:
    """Names in the functions of a module.

    Attributes
    ----------
    fields
        Fields of the parameters.
    local
        Dummy name → local name of parameters, coordinates, velocities, states, inputs, flags of
        contacts and targets of impulses.
    flags
        Local names of the flags of contacts.
    """

    fields: tuple[str, ...]
    local: Mapping[str, str]
    flags: tuple[str, ...]

    @cached_property
    def taken(self) -> frozenset[str]:
        """Return all local names of the scene."""
        return frozenset(self.local.values())

    @property
    def counters(self) -> list[str]:
        """Return names of counters of nested loops, outermost first."""
        return [c for c in _COUNTERS if c not in self.taken] + [f"{c}_" for c in _COUNTERS]

    def free(self, name: str) -> str:
        """Return a name of a program's own, changed where the scene has it."""
        while name in self.taken:
            name += "_"
        return name


def scene_names(equations: Equations) -> SceneNames:
    """Choose the names of the functions of a module."""
    system = equations.system
    coordinates = [c.name for c in system.coordinates]
    contacts = [contact.name for contact in system.contacts]
    dummies = {f"p{k}": p.name for k, p in enumerate(system.parameters)}
    dummies |= {f"q{k}": name for k, name in enumerate(coordinates)}
    dummies |= {f"v{k}": f"{_stem(name)}_dot" for k, name in enumerate(coordinates)}
    dummies |= {f"z{k}": state.name for k, state in enumerate(system.states)}
    dummies |= {f"u{k}": input_identifier(source) for k, source in enumerate(system.inputs)}
    first = len(system.parameters)
    dummies |= {f"p{first + k}": name for k, name in enumerate(contacts)}
    after = first + len(contacts)
    dummies |= {f"p{after + k}": f"target_{_stem(name)}" for k, name in enumerate(contacts)}
    local = unique_identifiers(dummies.values(), PYTHON_RESERVED | _USED)
    names = dict(zip(dummies, local, strict=True))
    fields = unique_identifiers((p.name for p in system.parameters), PYTHON_RESERVED)
    flags = tuple(names[f"p{first + k}"] for k in range(len(contacts)))
    return SceneNames(tuple(fields), names, flags)


def _stem(name: str) -> str:
    """Return a name that takes an ending: x[1] becomes x_1."""
    return re.sub(r"\W+", "_", name).strip("_")
