"""Rigid bodies beside MuJoCo, Pinocchio and SymPy's KanesMethod.

    python benchmarks/bodies.py trees [--count 100] [--seed 36] [--most 10]
    python benchmarks/bodies.py arm

``trees`` derives random trees of bodies with hinges and slides about any axes, with offset centres
and full tensors of inertia, and compares M, f and the accelerations of emitted code at a random
state with those libraries, relative to the largest entry. ``arm`` takes the shipped KUKA iiwa from
its scene to C and compares the time of a call with that of Pinocchio's articulated-body algorithm,
which is called 100,000 times from Python, less the time of calls that do next to nothing. MuJoCo
and Pinocchio are left out where they are not installed; trees of up to three bodies go through
KanesMethod.
"""

from __future__ import annotations

import argparse
import importlib.util
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import mpmath
import numpy as np

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

from lagrange_cli.api import Derivation, load, loads  # noqa: E402
from lagrange_cli.mechanics.numerics.autodiff import evaluate  # noqa: E402

#: Bodies of the largest tree that goes through KanesMethod, whose expressions grow fast.
KANE = 3
GRAVITY = 9.81


@dataclass(frozen=True)
class TreeBody:
    """A body of a tree, with its joint against the parent, which is −1 in space.

    Offsets and axes are in the parent's axes, ``axis`` after the constant turn about x by ``tilt``.
    """

    parent: int
    at: np.ndarray
    tilt: float
    axis: np.ndarray
    slides: bool
    mass: float
    centre: np.ndarray
    inertia: np.ndarray


def random_tree(rng: np.random.Generator, size: int) -> list[TreeBody]:
    bodies = []
    for number in range(size):
        axis = np.eye(3)[rng.integers(3)] if rng.random() < 0.6 else rng.integers(-3, 4, 3) * 1.0
        if not axis.any():
            axis = np.array([1.0, 2.0, 2.0])
        turned, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        a, b, c = rng.uniform(0.05, 0.4, 3) ** 2
        mass = round(rng.uniform(0.2, 3), 2)
        own = turned @ np.diag([b + c, a + c, a + b]) @ turned.T * mass / 12
        bodies.append(
            TreeBody(
                int(rng.integers(max(-1, number - 3), number)),
                rng.uniform(-0.4, 0.4, 3).round(2),
                round(rng.uniform(-1, 1), 1) if rng.random() < 0.3 else 0.0,
                axis,
                bool(rng.random() < 0.25),
                mass,
                rng.uniform(-0.2, 0.2, 3).round(2),
                (own + own.T) / 2,
            )
        )
    return bodies


def scene_of(bodies: list[TreeBody]) -> str:
    """The same tree as a scene."""
    lines = ["bodies:"]
    for k, body in enumerate(bodies):
        at, turn = [repr(float(x)) for x in body.at], []
        if body.tilt:
            turn.append(f"{{x: {body.tilt}}}")
        on = "" if body.parent < 0 else f"on: b{body.parent}, "
        axis = body.axis / np.linalg.norm(body.axis)
        if body.slides:
            cosine, sine = np.cos(body.tilt), np.sin(body.tilt)
            along = np.array([[1, 0, 0], [0, cosine, -sine], [0, sine, cosine]]) @ axis
            at = [f"{x} + {float(u)!r}*q{k}" for x, u in zip(at, along, strict=True)]
        else:
            turn.append(f"{{axis: {[float(x) for x in body.axis]}, angle: q{k}}}")
        rows = [[float(x) for x in row] for row in body.inertia]
        lines.append(
            f"  b{k}: {{{on}at: [{', '.join(at)}], turn: [{', '.join(turn)}], mass: {body.mass},"
            f" centre: {[float(x) for x in body.centre]}, inertia: {rows}}}"
            if turn
            else f"  b{k}: {{{on}at: [{', '.join(at)}], mass: {body.mass},"
            f" centre: {[float(x) for x in body.centre]}, inertia: {rows}}}"
        )
    names = [f"q{k}" for k in range(len(bodies))]
    lines.append(f"coordinates: [{', '.join(names)}]")
    lines.append(f"potentials: {{weight: {{gravity: {GRAVITY}}}}}")
    lines.append(f"initial: {{{', '.join(f'{name}: 0' for name in names)}}}")
    return "\n".join(lines) + "\n"


Result = tuple[np.ndarray, np.ndarray, np.ndarray]
"""M, f with M a = f, and a."""


def by_lagrange(derivation: Derivation, q: np.ndarray, v: np.ndarray) -> Result:
    system = derivation.equations.system
    n = len(q)
    values = {c.q: mpmath.mpf(float(x)) for c, x in zip(system.coordinates, q, strict=True)}
    values |= {c.v: mpmath.mpf(float(x)) for c, x in zip(system.coordinates, v, strict=True)}
    entries = [*(e for row in system.mass_matrix for e in row), *system.forcing]
    with mpmath.workdps(30):
        numbers = [float(x) for x in evaluate(entries, values)]
    module = python_module(derivation)
    rates = np.asarray(module.rhs(0.0, np.concatenate([q, v])))
    return np.reshape(numbers[: n * n], (n, n)), np.array(numbers[n * n :]), rates[n:]


def python_module(derivation: Derivation) -> ModuleType:
    (text,) = derivation.emit("python").values()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "tree.py"
        path.write_text(text)
        spec = importlib.util.spec_from_file_location("tree", path)
        assert spec is not None
        assert spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
    return module


def by_pinocchio(bodies: list[TreeBody], q: np.ndarray, v: np.ndarray) -> Result:
    import pinocchio as pin

    model = pin.Model()
    model.gravity.linear = np.array([0, 0, -GRAVITY])
    joints: dict[int, int] = {}
    # Its composite bodies need the joints of each subtree one after the other.
    for k in depth_first(bodies, -1):
        body = bodies[k]
        axis = body.axis / np.linalg.norm(body.axis)
        kinds = (pin.JointModelRevoluteUnaligned, pin.JointModelPrismaticUnaligned)
        turn = pin.rpy.rpyToMatrix(body.tilt, 0, 0)
        parent = 0 if body.parent < 0 else joints[body.parent]
        joint = kinds[body.slides](*axis)
        joints[k] = model.addJoint(parent, joint, pin.SE3(turn, body.at), f"q{k}")
        inertia = pin.Inertia(body.mass, body.centre, body.inertia)
        model.appendBodyToJoint(joints[k], inertia, pin.SE3.Identity())
    data = model.createData()
    order = np.array([joints[k] - 1 for k in range(len(bodies))])
    state = np.empty((2, len(q)))
    state[:, order] = q, v
    mass = pin.crba(model, data, state[0])
    mass = np.triu(mass) + np.triu(mass, 1).T
    bias = pin.nonLinearEffects(model, data, *state)
    rates = pin.aba(model, data, *state, np.zeros(len(q)))
    return mass[np.ix_(order, order)], -bias[order], rates[order]


def depth_first(bodies: list[TreeBody], parent: int) -> Iterator[int]:
    """Yield the numbers of the bodies on one, each before those on it."""
    for k, body in enumerate(bodies):
        if body.parent == parent:
            yield k
            yield from depth_first(bodies, k)


def by_mujoco(bodies: list[TreeBody], q: np.ndarray, v: np.ndarray) -> Result:
    import mujoco

    def numbers(values: np.ndarray) -> str:
        return " ".join(repr(float(x)) for x in values)

    def text(parent: int) -> str:
        parts = []
        for k, body in enumerate(bodies):
            if body.parent != parent:
                continue
            (xx, xy, xz), (_, yy, yz), (_, _, zz) = body.inertia
            kind = "slide" if body.slides else "hinge"
            parts.append(
                f'<body name="b{k}" pos="{numbers(body.at)}" euler="{body.tilt!r} 0 0">'
                f'<joint name="q{k}" type="{kind}" axis="{numbers(body.axis)}"/>'
                f'<inertial pos="{numbers(body.centre)}" mass="{body.mass!r}"'
                f' fullinertia="{numbers(np.array([xx, yy, zz, xy, xz, yz]))}"/>{text(k)}</body>'
            )
        return "".join(parts)

    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><compiler angle="radian"/><option gravity="0 0 -{GRAVITY}"/>'
        f"<worldbody>{text(-1)}</worldbody></mujoco>"
    )
    data = mujoco.MjData(model)
    order = [model.joint(f"q{k}").dofadr[0] for k in range(len(bodies))]
    data.qpos[order], data.qvel[order] = q, v
    mujoco.mj_forward(model, data)
    mass = np.zeros((len(q), len(q)))
    mujoco.mj_fullM(model, data, mass)
    return mass[np.ix_(order, order)], -data.qfrc_bias[order], data.qacc_smooth[order].copy()


def by_kane(bodies: list[TreeBody], q: np.ndarray, v: np.ndarray) -> Result:
    """M and f of SymPy's KanesMethod, its numbers as rationals and its result in 30 digits."""
    import sympy as sp
    from sympy.physics.mechanics import (
        KanesMethod,
        Point,
        ReferenceFrame,
        RigidBody,
        dynamicsymbols,
        inertia,
    )

    def exact(value: float) -> sp.Rational:
        return sp.Rational(repr(float(value)))

    space, origin = ReferenceFrame("N"), Point("O")
    origin.set_vel(space, 0)
    coordinates = dynamicsymbols(f"q:{len(bodies)}")
    speeds = dynamicsymbols(f"u:{len(bodies)}")
    frames, places, parts, loads = [], [], [], []
    for k, body in enumerate(bodies):
        base = space if body.parent < 0 else frames[body.parent]
        start = origin if body.parent < 0 else places[body.parent]
        tilted = base.orientnew(f"T{k}", "Axis", [exact(body.tilt), base.x])
        length = sp.sqrt(sum(exact(x) ** 2 for x in body.axis))
        axis = sum((exact(x) / length * e for x, e in zip(body.axis, tilted, strict=True)), 0)
        frame = tilted
        offset = sum((exact(x) * e for x, e in zip(body.at, base, strict=True)), 0)
        place = Point(f"P{k}")
        if body.slides:
            place.set_pos(start, offset + coordinates[k] * axis)
        else:
            frame = tilted.orientnew(f"B{k}", "Axis", [coordinates[k], axis])
            frame.set_ang_vel(tilted, speeds[k] * axis)
            place.set_pos(start, offset)
        velocity = start.vel(space) + base.ang_vel_in(space).cross(place.pos_from(start))
        place.set_vel(space, velocity + (speeds[k] * axis if body.slides else 0))
        centre = place.locatenew(
            f"C{k}", sum((exact(x) * e for x, e in zip(body.centre, frame, strict=True)), 0)
        )
        centre.v2pt_theory(place, space, frame)
        (xx, xy, xz), (_, yy, yz), (_, _, zz) = [[exact(x) for x in row] for row in body.inertia]
        tensor = inertia(frame, xx, yy, zz, xy, yz, xz)
        parts.append(RigidBody(f"b{k}", centre, frame, exact(body.mass), (tensor, centre)))
        loads.append((centre, -exact(body.mass) * exact(GRAVITY) * space.z))
        frames.append(frame)
        places.append(place)
    rates = [s - c.diff() for c, s in zip(coordinates, speeds, strict=True)]
    kane = KanesMethod(space, q_ind=coordinates, u_ind=speeds, kd_eqs=rates)
    kane.kanes_equations(parts, loads)
    values = dict(zip([*coordinates, *speeds], [exact(x) for x in (*q, *v)], strict=True))
    mass = np.array(kane.mass_matrix.subs(values).evalf(30), dtype=float)
    forcing = np.array(kane.forcing.subs(values).evalf(30), dtype=float).ravel()
    return mass, forcing, np.linalg.solve(mass, forcing)


PEERS = {"MuJoCo": ("mujoco", by_mujoco), "Pinocchio": ("pinocchio", by_pinocchio)}


@dataclass(frozen=True)
class Compared:
    """Largest differences of a tree, of M, f and a, relative to the largest entry of each."""

    size: int
    seconds: float
    differences: dict[str, tuple[float, float, float]]


def compared(rng: np.random.Generator, size: int) -> Compared:
    bodies = random_tree(rng, size)
    q, v = rng.uniform(-1.5, 1.5, (2, size))
    begin = time.process_time()
    derivation = loads(scene_of(bodies)).derive()
    result = by_lagrange(derivation, q, v)
    seconds = time.process_time() - begin
    differences = {}
    for name, (library, function) in PEERS.items():
        if importlib.util.find_spec(library) is not None:
            differences[name] = _differences(result, function(bodies, q, v))
    if size <= KANE:
        differences["KanesMethod"] = _differences(result, by_kane(bodies, q, v))
    return Compared(size, seconds, differences)


def _differences(result: Result, other: Result) -> tuple[float, float, float]:
    m, f, a = (
        float(np.abs(x - y).max() / max(np.abs(y).max(), 1e-300))
        for x, y in zip(result, other, strict=True)
    )
    return m, f, a


def trees(count: int, seed: int, most: int) -> Iterator[Compared]:
    for number in range(count):
        yield compared(np.random.default_rng([seed, number]), 1 + number % most)


def table(results: list[Compared]) -> str:
    """The largest difference of M, f and a from any of the libraries, by the number of bodies."""
    lines = ["| bodies | trees | compared with | largest difference |", "|---|---|---|---|"]
    for size in sorted({r.size for r in results}):
        alike = [r for r in results if r.size == size]
        peers = ", ".join(sorted({name for r in alike for name in r.differences}))
        worst = max(max(d) for r in alike for d in r.differences.values())
        lines.append(f"| {size} | {len(alike)} | {peers} | {worst:.1e} |")
    return "\n".join(lines)


_LOOP = r"""
#include <stdio.h>
#include <time.h>
#include "kuka_iiwa.h"
int main(void) {
  kuka_iiwa_params p;
  kuka_iiwa_defaults(&p);
  double y[14], u[7], work[kuka_iiwa_WORK + 1], out[14], sum = 0.0, best = 1e9;
  for (int k = 0; k < 14; k++) y[k] = 0.1 * (k % 5) - 0.2;
  for (int k = 0; k < 7; k++) u[k] = 0.0;
  for (int round = 0; round < 200; round++) {
    struct timespec a, b;
    clock_gettime(CLOCK_MONOTONIC, &a);
    for (int k = 0; k < 1000; k++) {
      y[0] += 1e-9;
      kuka_iiwa_rhs(0.0, y, u, &p, work, out);
      sum += out[13];
    }
    clock_gettime(CLOCK_MONOTONIC, &b);
    double each = ((b.tv_sec - a.tv_sec) * 1e9 + (b.tv_nsec - a.tv_nsec)) / 1e6;
    if (each < best) best = each;
  }
  printf("%.3f %g\n", best, sum);
  return 0;
}
"""


def arm() -> None:
    """Print seconds from the scene to C, and microseconds a call, the best of many rounds."""
    begin = time.process_time()
    derivation = load(str(ROOT / "systems" / "robots" / "kuka_iiwa.yaml")).derive()
    files = derivation.emit("c")
    print(f"scene to C, certified: {time.process_time() - begin:.1f} s of CPU")
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for name, text in files.items():
            (Path(folder) / name).write_text(text)
        (Path(folder) / "loop.c").write_text(_LOOP)
        sources = ["loop.c", "kuka_iiwa.c"]
        for flags in (["-O2"], ["-O3", "-march=native", "-ffast-math"]):
            build = ["gcc", *flags, *sources, "-o", "loop", "-lm"]
            subprocess.run(build, cwd=folder, check=True)
            done = subprocess.run(["./loop"], cwd=folder, check=True, capture_output=True)
            rows.append((f"emitted C, gcc {' '.join(flags)}", float(done.stdout.split()[0])))
    if importlib.util.find_spec("pinocchio") is not None:
        whole, overhead = _aba()
        rows.append(("Pinocchio's ABA, called from Python", whole))
        rows.append(("the same call with a model of no joints, or of q + v alone", overhead))
        rows.append(("Pinocchio's ABA, the larger of these taken off", whole - overhead))
    print("| right-hand side | µs a call |\n|---|---|")
    print("\n".join(f"| {name} | {each:.2f} |" for name, each in rows))


def _aba() -> tuple[float, float]:
    """Microseconds of a call of ABA in batches of 100,000, and of calls that do next to nothing.

    The one passes the same kinds of arguments without numbers in them, the other two of the three
    arrays, whose sum it returns.
    """
    import pinocchio as pin

    sys.path.insert(0, str(ROOT))
    from tests.robots.published import iiwa

    model = pin.buildModelFromXML(iiwa())
    data = model.createData()
    q, v, tau = np.full(7, 0.1), np.full(7, 0.2), np.zeros(7)

    def best(call: Callable[..., object], *arguments: object) -> float:
        times = []
        for _ in range(500):
            begin = time.perf_counter()
            for _ in range(200):
                call(*arguments)
            times.append((time.perf_counter() - begin) / 200)
        return 1e6 * min(times)

    empty = pin.Model()
    nothing, none = empty.createData(), np.zeros(0)
    empty_call = best(pin.aba, empty, nothing, none, none, none)
    return best(pin.aba, model, data, q, v, tau), max(empty_call, best(pin.integrate, model, q, v))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=["trees", "arm"])
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=36)
    parser.add_argument("--most", type=int, default=10)
    chosen = parser.parse_args()
    if chosen.what == "arm":
        arm()
        return
    results = []
    for result in trees(chosen.count, chosen.seed, chosen.most):
        results.append(result)
        worst = max((max(d) for d in result.differences.values()), default=0.0)
        print(f"{len(results)}: {result.size} bodies, {worst:.1e}", file=sys.stderr, flush=True)
    print(table(results))


if __name__ == "__main__":
    main()
