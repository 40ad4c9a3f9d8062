"""Systems with one-sided constraints built by hand, and their code for the simulation."""

from __future__ import annotations

import ctypes
import math

import numpy as np
import sympy as sp

from lagrange_cli import loads
from lagrange_cli.emit.c.constraints import workspace_size
from lagrange_cli.mechanics.system import Contact, InitialState
from lagrange_cli.program.emitted_functions import constraint_programs, contact_programs
from lagrange_cli.program.program import build_program
from lagrange_cli.program.systems.contact_systems import with_contact_flags
from lagrange_cli.simulate.native.rounding_model import perturb
from lagrange_cli.simulate.native.sources import library_source
from lagrange_cli.simulate.system.constraints import Impacts, projection
from tests.emit import emit_closures as closures
from tests.emit import emit_systems as systems
from tests.emit.emitted_c import shared_library
from tests.parts import changed
from tests.program.interpreted import interpreted


def contact(name, gap, coordinates, restitution=0):
    """A contact with the gap φ(q, t) ≥ 0."""
    text = f"{gap} >= 0"
    return Contact(closures.closure(name, gap, coordinates, text), sp.sympify(restitution))


def with_contacts(equations, *contacts, name=None):
    return changed(equations, contacts=contacts, name=name or equations.presentation.name)


def bouncing_ball():
    m, g, e = closures.positive(m=2.0, g=9.81, e=0.8)
    x, z = systems.coordinate("x"), systems.coordinate("z")
    free = systems.build(
        "bouncing_ball",
        [m, g, e],
        [x, z],
        [("ball", m.symbol, (x.q, 0, z.q))],
        m.symbol * g.symbol * z.q,
        diagonal=True,
        initial=InitialState((0.0, 1.0), (0.5, 0.0)),
        until=2.0,
    )
    return with_contacts(free, contact("floor", z.q, [x, z], e.symbol))


def particle_on_sphere():
    m, g, r = closures.positive(m=1.0, g=9.81, R=1.5)
    x, z = systems.coordinate("x"), systems.coordinate("z")
    free = systems.build(
        "particle_on_sphere",
        [m, g, r],
        [x, z],
        [("particle", m.symbol, (x.q, 0, z.q))],
        m.symbol * g.symbol * z.q,
        diagonal=True,
        initial=InitialState((1.5 * math.sin(0.3), 1.5 * math.cos(0.3)), (0.0, 0.0)),
        until=1.0,
    )
    return with_contacts(free, contact("sphere", x.q**2 + z.q**2 - r.symbol**2, [x, z]))


def ladder():
    """A rod of mass m whose ends touch a floor and a wall, in x, z, theta of its centre."""
    m, inertia, g, a = closures.positive(m=1.2, J=0.3, g=9.81, a=0.8)
    x, z, theta = (systems.coordinate(name) for name in ("x", "z", "theta"))
    free = systems.build(
        "ladder",
        [m, inertia, g, a],
        [x, z, theta],
        [("centre", m.symbol, (x.q, 0, z.q))],
        m.symbol * g.symbol * z.q,
        kinetic=inertia.symbol * theta.v**2 / 2,
        diagonal=True,
    )
    floor = contact("floor", z.q - a.symbol * sp.cos(theta.q), [x, z, theta])
    wall = contact("wall", x.q - a.symbol * sp.sin(theta.q), [x, z, theta])
    return with_contacts(free, floor, wall)


def balls(n, masses=None):
    """Balls of diameter d in a row, without gravity, with restitution e."""
    of = [systems.parameter(f"m{i}", (masses or [1.0] * n)[i], positive=True) for i in range(n)]
    d, e = closures.positive(d=0.5, e=1.0)
    row = [systems.coordinate(f"x{i}") for i in range(n)]
    particles = [(f"b{i}", of[i].symbol, (row[i].q, 0, 0)) for i in range(n)]
    free = systems.build("balls", [*of, d, e], row, particles, 0, diagonal=True)
    gaps = [row[i + 1].q - row[i].q - d.symbol for i in range(n - 1)]
    return with_contacts(
        free, *(contact(f"c{i}", gap, row, e.symbol) for i, gap in enumerate(gaps))
    )


def corner(*gaps, restitution=0):
    """A particle in the plane with gaps given as functions of x, z, t."""
    m, g, e = closures.positive(m=2.0, g=9.81, e=0.5)
    x, z = systems.coordinate("x"), systems.coordinate("z")
    free = systems.build(
        "corner",
        [m, g, e],
        [x, z],
        [("particle", m.symbol, (x.q, 0, z.q))],
        m.symbol * g.symbol * z.q,
        diagonal=True,
    )
    e = e.symbol if restitution else 0
    return with_contacts(
        free,
        *(contact(f"g{k}", gap(x.q, z.q, systems.T), [x, z], e) for k, gap in enumerate(gaps)),
    )


def pendulum_at_wall():
    """A particle on a rod, a closure, beside a wall at x = w with restitution e."""
    equations = closures.pendulum()
    w, e = closures.positive(w=0.5, e=0.7)
    x, z = equations.system.coordinates
    equations = changed(equations, parameters=(*equations.system.parameters, w, e))
    return with_contacts(
        equations, contact("wall", w.symbol - x.q, [x, z], e.symbol), name="pendulum_at_wall"
    )


def sleigh_at_wall():
    """Chaplygin's sleigh, a velocity closure, beside two walls, one of which moves."""
    equations = closures.sleigh()
    x, y, theta = equations.system.coordinates
    near = contact("near", 2 - x.q, equations.system.coordinates, sp.Rational(1, 3))
    far = contact("far", y.q + sp.sin(3 * systems.T) + theta.q**2, equations.system.coordinates)
    return with_contacts(equations, near, far, name="sleigh_at_wall")


#: More states of first order than all arrays of one contact have numbers: what is stored beyond
#: an array is stored beyond all of them.
LAGS = """
states:
  s1: (dot(z) - s1)/T
  s2: (s1 - s2)/T
  s3: (s2 - s3 - z)/T
  s4: (s3 - s4)/T + sin(t)
  s5: (s4 - s5)/T
  s6: (s5 - s6)/T
"""

BALL_IN_AIR = f"""
name: ball_in_air
parameters: {{m: 1, g: 9.81, T: 0.4, k: 0.5, e: 0.7}}
particles:
  ball: {{mass: m, position: [0, 0, z]}}
coordinates: [z]
constraints: {{floor: {{unilateral: 'z >= 0', restitution: e}}}}
potentials: {{weight: {{gravity: g}}}}
{LAGS}
forces: {{air: {{on: z, force: -k*(s1 + s6)}}}}
initial: {{z: 1, dot(z): 0, s1: 0, s2: 0, s3: 0, s4: 0, s5: 0, s6: 0}}
simulate: {{until: 1.2}}
"""

PENDULUM_IN_AIR = f"""
name: pendulum_in_air
parameters: {{m: 1, g: 9.81, T: 0.4, k: 0.5, e: 0.7, l: 1, w: 0.3}}
particles:
  bob: {{mass: m, position: [x, 0, z]}}
coordinates: [x, z]
constraints:
  rod: x^2 + z^2 = l^2
  wall: {{unilateral: w - x >= 0, restitution: e}}
potentials: {{weight: {{gravity: g}}}}
{LAGS}
forces: {{air: {{on: z, force: -k*(s1 + s6)}}}}
initial: {{x: -0.6, z: -0.8, dot(x): 0, dot(z): 0, s1: 0, s2: 0, s3: 0, s4: 0, s5: 0, s6: 0}}
simulate: {{until: 1.2}}
"""


def in_air(text):
    """A system with states of first order beside a contact, of its scene."""
    return loads(text).derive().equations


#: Systems with states of first order.
IN_AIR = {
    "ball_in_air": lambda: in_air(BALL_IN_AIR),
    "pendulum_in_air": lambda: in_air(PENDULUM_IN_AIR),
}


def chain_over_floor(n=16):
    """A chain of rods, whose multipliers are a band, over a floor for each of its masses."""
    equations = closures.chain(n)
    of = equations.system.coordinates
    floors = [contact(f"floor{i}", of[2 * i + 1].q + 3, of) for i in range(0, n, 5)]
    return with_contacts(equations, *floors, name="chain_over_floor")


CASES = {
    "bouncing_ball": bouncing_ball,
    "particle_on_sphere": particle_on_sphere,
    "ladder": ladder,
    "balls": lambda: balls(4, [1.0, 2.0, 0.5, 3.0]),
    "moving_walls": lambda: corner(
        lambda x, z, t: z - sp.sin(3 * t) / 4, lambda x, z, t: x * z + 2 - t
    ),
    "pendulum_at_wall": pendulum_at_wall,
    "sleigh_at_wall": sleigh_at_wall,
    "chain_over_floor": chain_over_floor,
}


def simulation_programs(equations):
    e = with_contact_flags(equations)
    programs = {
        "rhs": build_program(e, ["acceleration"]),
        **constraint_programs(e),
        **contact_programs(e),
    }
    return programs | {"contact_disturbed": perturb(programs["contact_rhs"])}


def defaults(equations):
    return np.array([p.value for p in equations.system.parameters])


class Interpreted:
    """The functions that simulation interprets; each gives None where it has no result."""

    def __init__(self, equations):
        self.functions = interpreted(simulation_programs(equations))
        self.contacts = len(equations.system.contacts)
        self.first = len(equations.system.parameters)

    def _parameters(self, p, flags, targets):
        targets = np.zeros(self.contacts) if targets is None else targets
        return [*map(float, p), *map(float, flags), *map(float, targets)]

    def __call__(self, function, t, y, p, flags, targets=None, size=None):
        if function == "events":
            found = self._impacts(t, p, flags).events(np.array(y, float))
        else:
            found = self.functions[function](t, y, self._parameters(p, flags, targets))
        return found if np.isfinite(found).all() else None

    def project(self, t, y, p, flags):
        project = projection(self.functions, self._parameters(p, flags, None), "contact_")
        found = project(t, y)
        return found if np.isfinite(found).all() else None

    def _impacts(self, t, p, flags):
        parameters = self._parameters(p, flags, None)
        return Impacts(self.functions, t, parameters, [], self.first, self.contacts)

    def reset(self, t, y, p, flags, event, bounce=1.0):
        found = self._impacts(t, p, flags).reset(np.array(y, float), event, bounce)
        return None if found[0] is None else found

    def leaving_none(self, t, y, p, flags, event):
        """Which contacts leave no motion."""
        state, found = self._impacts(t, p, flags).reset(np.array(y, float), event, 1.0)
        assert state is None
        return list(found)


class Machine:
    """The same in machine code."""

    def __init__(self, equations, folder):
        programs = simulation_programs(equations)
        source = folder / f"{len(list(folder.iterdir()))}.c"
        source.write_text(library_source(programs), encoding="utf-8")
        self.library = shared_library(source)
        self.contacts, self.work = len(equations.system.contacts), workspace_size(programs)
        self.factors = programs["contact_disturbed"].parameters

    def _given(self, y, p, flags, targets):
        parameters = np.zeros(self.factors)
        targets = np.zeros(self.contacts) if targets is None else targets
        head = [*p, *flags, *targets]
        parameters[: len(head)] = head
        # What lies behind the workspace must not be touched.
        work = np.full(self.work + 1, np.nan)
        return np.array(y, dtype=float), parameters, work

    def _call(self, function, t, arrays, *more):
        y, p, work, *out = (ctypes.c_void_p(a.ctypes.data) for a in arrays)
        of = getattr(self.library, f"system_{function}")
        status = of(ctypes.c_double(t), y, None, p, *more, work, *out)
        assert np.isnan(arrays[2][-1])
        return status

    def __call__(self, function, t, y, p, flags, targets=None, size=None):
        out = np.full(size, np.nan)
        status = self._call(function, t, (*self._given(y, p, flags, targets), out))
        return None if status else out

    def project(self, t, y, p, flags):
        arrays = self._given(y, p, flags, None)
        return None if self._call("contact_project", t, arrays) else arrays[0]

    def leaving_none(self, t, y, p, flags, event):
        """Which contacts leave no motion."""
        arrays = self._given(y, p, flags, None)
        assert self._call("reset", t, arrays, ctypes.c_long(event), ctypes.c_double(1.0)) == 4
        return list(arrays[1][len(p) : len(p) + self.contacts])

    def reset(self, t, y, p, flags, event, bounce=1.0):
        arrays = self._given(y, p, flags, None)
        more = ctypes.c_long(event), ctypes.c_double(bounce)
        if self._call("reset", t, arrays, *more):
            return None
        return arrays[0], arrays[1][len(p) : len(p) + self.contacts]
