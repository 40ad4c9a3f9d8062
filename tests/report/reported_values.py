"""Values of every report, made up by hand: their numbers are those of no run and of no clock."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from lagrange_cli.check import Report, SceneReport
from lagrange_cli.errors import Problem
from lagrange_cli.report.contents.section import FoundSection
from lagrange_cli.report.values.check import CacheView
from lagrange_cli.report.values.simulation import Simulated, SimulatedMembers
from lagrange_cli.simulate.ensemble.store.blocks import Failure, NumberRange
from lagrange_cli.simulate.model.labels import Labels
from lagrange_cli.studies.fit.noise import SerialCorrelation
from lagrange_cli.studies.fit.result import (
    Fit,
    FitFinding,
    FitKind,
    FitMinimum,
    FittedColumn,
    FittedValue,
)
from lagrange_cli.studies.path.ends import End
from lagrange_cli.studies.path.measure import StationaryPath
from lagrange_cli.studies.path.morse import Conjugacy
from lagrange_cli.studies.path.result import Paths
from lagrange_cli.studies.reference import Reference
from lagrange_cli.studies.section.result import Section, SectionPoints
from lagrange_cli.studies.stress.measure import Stress
from lagrange_cli.studies.stress.points import StressPoint
from lagrange_cli.studies.stress.runs import StressRun
from lagrange_cli.studies.tradeoff.result import CostRatios, Trade
from lagrange_cli.studies.tradeoff.runs import Setting, WorkPrecisionPoint

#: Stands for what no report looks at.
ANY: Any = SimpleNamespace()


def motion(name: str) -> Simulated:
    """A motion with events, further columns and a conserved quantity."""
    state = {"z": 0.0687074614, "dot(z)": -0.0153541334, name: 1.5}
    bounce = SimpleNamespace(t=0.451523641, name=f"contact:{name}", state={"z": 1e-16})
    trajectory = SimpleNamespace(
        name=name,
        labels=Labels(energy="h", units={"z": "m"}),
        reason="",
        remarks=(name,),
        coordinates=("z",),
        t=np.array([0.0, 3.0]),
        state=state,
        columns={"z": ANY, "dot(z)": ANY, name: ANY},
        conserved_drift={"energy": None},
        events=[bounce] * 13,
        slides=[SimpleNamespace(on=f"dot({name})", start=1.0, end=None)],
        requested=1e-9,
        estimated=1.5e-14,
        holds_until=3.0,
        energy_drift=3.6e-16,
        constraint_drift=2e-15,
        formulation="multiplier",
        method="DOP853",
        steps=131,
        rhs_evaluations=1592,
        implementation="compiled C",
        table=lambda extra: {"t": [3.0], "energy": [-9.81], "p_z": [np.inf]},
    )
    model = SimpleNamespace(outputs=(), formulation="minimal")
    return Simulated(trajectory, model, ("energy",))  # type: ignore[arg-type]


def ensemble(name: str) -> SimulatedMembers:
    """Members of which some failed, with numbers of their motions of every kind."""
    ranges = {
        "max(z)": (NumberRange(0.1, 9.36637, 4), 4e-7),
        "min(z)": (NumberRange(0.0, 1.0, 1), np.inf),
        f"first({name})": (NumberRange(np.nan, np.nan, 0), np.inf),
        "last(z)": (NumberRange(np.nan, np.nan, 0), 0.0),
        "mean(z)": (NumberRange(1.0, 2.0, 4), np.nan),
    }
    store = SimpleNamespace(
        counts=lambda: {"ok": 2, "blow_up": 14},
        estimated=lambda: 2.5e-10,
        failures=lambda: iter([Failure(k, "blow_up", name, 0.5) for k in range(14)]),
        ranges=lambda: {
            f"{kind}/{n}": r if kind == "reduced" else NumberRange(e, e, 1)
            for n, (r, e) in ranges.items()
            for kind in ("reduced", "reduced_error")
        },
    )
    members = SimpleNamespace(values=lambda k: {name: "1e3"}, __len__=lambda: 16)
    plan = SimpleNamespace(model=SimpleNamespace(name=name), alone=True)
    listed = type("Members", (), {"values": members.values, "__len__": lambda self: 16})()
    listed.values = members.values
    return SimulatedMembers(plan, listed, store, None, {"derive": 1.0, "integrate": 4.0})  # type: ignore[arg-type]


def points(name: str, **changed: Any) -> SectionPoints:
    known: dict[str, Any] = {
        "t": np.arange(13.0),
        "columns": {"z": np.linspace(-1.0, 1.0, 13), "dot(z)": np.full(13, 1e-17)},
        "energy": np.zeros(13),
        "error": np.full(13, 2e-9),
        "open": (1.0, 2.0, 3.0, 4.0, 5.0),
        "status": "ok",
        "reason": name,
        "requested": 1e-9,
        "estimated": 1e-10,
        "scales": {},
        "holds_until": 20.0,
        "energy_drift": None,
        "method": "taylor",
        "runs": 1,
        "seconds": 1.0,
        "given": {name: "2"},
    }
    return SectionPoints(**known | changed)


def section(name: str) -> FoundSection:
    """Points of one motion, some of them uncertain."""
    return FoundSection(Section(name, f"{name} = 0", (points(name),), ("z",), ("z",), ()))


def sections(name: str) -> FoundSection:
    """Points of several motions."""
    members = points(name), points(name, error=None, requested=None, open=(1.0,))
    return FoundSection(Section(name, "z = 0", members, ("z",), ("z",), ()))


def paths(name: str) -> Paths:
    """A minimum, and a saddle that ends a turn further."""
    first, last, further = (End(t, np.array([q])) for t, q in ((0, 0.0), (5, 0.0), (5, 6.28318531)))
    motions = SimpleNamespace(
        models=SimpleNamespace(motion=SimpleNamespace(name=name)), coordinates=(name,)
    )

    def path(end: End, velocity: float, conjugacy: Conjugacy) -> StationaryPath:
        shape = np.array([velocity])
        return StationaryPath(
            end, shape, -23.9932802, 1e-9, conjugacy, 1.8e-9, 4.4e-9, ANY, ANY, ANY
        )

    solutions = (
        path(last, -6.26417599, Conjugacy("minimum", 0)),
        path(further, 6.26417599, Conjugacy("saddle", 1, (3.63769,))),
        path(last, 0.0, Conjugacy("undecided", None)),
    )
    scan = SimpleNamespace(count=285, reach=12.5284, energy=68.67, is_resolved=False)
    return Paths(
        first,
        last,
        solutions,
        1e-9,
        32,
        2,
        (name,),
        0,
        motions,
        scan,
        deflated=1,  # type: ignore[arg-type]
    )


def fit(name: str) -> Fit:
    """A fit of values of every size of error, two of them correlated."""
    values = (
        FittedValue("k", 2.5, 3.0, 0.5),
        FittedValue(name, 1.0, 6.02214076e23, 1.5e17),
        FittedValue("c", 0.0, 0.125, None),
    )
    test = SerialCorrelation(23.0, 10, 0.0106)
    columns = (
        FittedColumn(name, np.arange(3.0), np.arange(3.0), np.ones(3), np.ones(3), test),
        FittedColumn("x", np.arange(3.0), np.arange(3.0), np.ones(3), np.ones(3)),
    )
    correlation = np.array([[1, 0.99, 0], [0.99, 1, 0], [0, 0, 1]])
    kinds: tuple[FitKind, ...] = (
        *("undetermined", "not_converged", "contradicted", "ambiguous", "at_bound", "remark"),
    )
    return Fit(
        name,
        tuple(FitFinding(kind, f"{name} fits as well") for kind in kinds),
        values,
        columns,
        correlation,
        4.2,
        1,
        True,
        0.04,
        "differences",
        17,
        12,
        (FitMinimum({"k": 2.5, "c": 0.0}, 0.01, 9), FitMinimum({"k": 4.0, "c": 0.2}, 0.1, 3)),
        ANY,
    )


def trade(name: str) -> Trade:
    """Runs that ended, were given up and failed."""
    good = WorkPrecisionPoint(
        Setting("DOP853", rtol=1e-6), "ok", "", 2.3e-6, True, 9, 196, 1.6e-6, (1e-5, 2e-5, 3e-5),
        pareto=True, pareto_evaluations=True,
    )  # fmt: skip
    coarse = WorkPrecisionPoint(
        Setting("RK4", step=0.005), "ok", "", 1e-16, False, 9, 1600, None, (6.4e-5,)
    )
    failed = [
        WorkPrecisionPoint(Setting("Radau", step=0.1 / k), "failed", name, evaluations=100)
        for k in (1, 2, 3)
    ]
    slow = WorkPrecisionPoint(Setting("BDF", rtol=1e-9), "given_up", name, evaluations=7)
    auto = WorkPrecisionPoint(
        Setting("auto", accuracy=1e-6), "ok", "", 2e-14, True, 9, 1033, None, (5e-5,),
        chosen="Gauss16",
    )  # fmt: skip
    lost = WorkPrecisionPoint(Setting("auto", accuracy=1e-9), "given_up", name, evaluations=3)
    ratios = CostRatios(auto, 1.1, 0.8, 2.7), CostRatios(lost)
    return Trade(
        name=name,
        until=2.0,
        samples=401,
        formulation="minimal",
        implementation="compiled C",
        stiff=False,
        reference=Reference(ANY, ANY, "DOP853 in long doubles", 4e-16, "Gauss16", 2e-16),
        points=(good, coarse, *failed, slow),
        automatic=ratios,
        left_out={"IDA": name},
        repeat=20,
        budget=1.0,
    )


def stress(name: str) -> Stress:
    """Points of every outcome."""
    runs = (
        StressRun(0, StressPoint("speed", 1e6, {name: "1e6"}, {}, "2"), "wrong", 1e-6, 1.0, 1e-9),
        StressRun(1, StressPoint("units", 1e3, scaled={"mass": 1e3}), "refused", reason=name * 4),
        StressRun(2, StressPoint("random", 2.0), "holds", 1e-6, 1e-8, 1e-9, reference=name),
    )
    return Stress(name, runs, ("size",), 5.0)


def checked(name: str) -> Report:
    return Report((SceneReport(name, "fail", 0.25, (Problem(name),)), SceneReport("b", "pass", 1)))


def cached(name: str) -> CacheView:
    cache = SimpleNamespace(folder=name, reason=name)
    return CacheView(cache, (), None)  # type: ignore[arg-type]


VALUES = {
    value.__name__: value
    for value in (
        *(motion, ensemble, section, sections, paths, fit, trade, stress),
        *(checked, cached),
    )
}
