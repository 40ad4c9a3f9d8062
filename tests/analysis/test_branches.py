"""Branches of equilibria against closed forms, and what is refused."""

from __future__ import annotations

import itertools
import math
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from lagrange_cli import InputError, load
from lagrange_cli.api import loads
from tests.test_defects import DEFECTS

SYSTEMS = Path(__file__).resolve().parents[2] / "systems"


def particle(potential=None, *, force=None, coordinates="x", parameters=""):
    """A particle of mass 1 in the plane, or on a line."""
    names = coordinates.split(", ")
    position = ", ".join([*names, "0", "0"][:3])
    acts = f"potentials: {{V: '{potential}'}}" if potential else f"forces: {force}"
    return f"""
name: particle
parameters: {{m: 1, p: 0.5{parameters}}}
particles: {{a: {{mass: m, position: [{position}]}}}}
coordinates: [{coordinates}]
{acts}
"""


def branches(scene, **over):
    derivation = loads(scene).derive() if isinstance(scene, str) else scene.derive()
    return derivation.analyze(branches=over).branches


def verdicts(branch):
    return [stretch.stability.verdict for stretch in branch.stretches]


def kinds(found):
    return [mark.kind for mark in found.marks]


@pytest.mark.slow
def test_pitchfork_of_the_bead_on_a_rotating_hoop():
    """Ω² = g/R, θ = ±acos(g/(R Ω²)) beyond (Goldstein, Poole and Safko, chapter 2)."""
    found = branches(load(SYSTEMS / "beads/bead_on_rotating_hoop.yaml"), omega=(0, 12))
    (mark,) = found.marks
    critical = math.sqrt(9.81 / 0.3)
    assert mark.kind == "pitchfork"
    assert mark.value == pytest.approx(critical, rel=1e-15)
    assert abs(mark.value - critical) <= 2 * mark.error < 1e-14
    assert mark.position == pytest.approx([0], abs=1e-15)
    bottom, tilted, top = found.branches
    assert verdicts(bottom) == ["stable", "unstable"]
    assert verdicts(tilted) == ["stable", "stable"]
    assert verdicts(top) == ["unstable"]
    expected = np.arccos(np.minimum(1, 9.81 / (0.3 * tilted.values**2)))
    # Beside the pitchfork the angle is a root of what is left of the parameter.
    assert np.abs(tilted.positions[:, 0]) == pytest.approx(expected, abs=1e-7)
    far = tilted.values > critical + 0.1
    assert np.abs(tilted.positions[far, 0]) == pytest.approx(expected[far], abs=4e-15)
    assert np.sign(tilted.positions[[0, -1], 0]).prod() == -1
    assert all(branch.ends == ("range", "range") for branch in found.branches)


@pytest.mark.slow
@pytest.mark.parametrize("bound", [1e3, 1e6])
def test_what_comes_and_goes_within_a_step_of_the_range_is_found(bound):
    """Between ±√(g/R) the lowest point is stable: a step is two thousand times as long."""
    found = branches(
        load(SYSTEMS / "beads/bead_on_rotating_hoop.yaml"), omega=(-bound, 1.3 * bound)
    )
    critical = math.sqrt(9.81 / 0.3)
    assert kinds(found) == ["pitchfork", "pitchfork"]
    assert [m.value for m in found.marks] == pytest.approx([-critical, critical], rel=1e-15)
    assert verdicts(found.branches[0]) == ["unstable", "stable", "unstable"]


@pytest.mark.slow
def test_flutter_far_below_the_end_of_the_range():
    """Above P = (7/2 + √2) k/l poles are real; there nothing else crosses the axis."""
    found = branches(load(SYSTEMS / "pendulums/zieglers_column.yaml"), P=(0, 400))
    assert kinds(found) == ["flutter"]
    assert found.marks[0].value == pytest.approx(3.5 - 2**0.5, rel=1e-15)


@pytest.mark.slow
def test_transcritical_point():
    """x (x - p) = 0: both branches pass, and change their stability."""
    found = branches(particle("x^3/3 - p*x^2/2"), p=(-1, 1.2))
    assert kinds(found) == ["transcritical"]
    assert found.marks[0].value == pytest.approx(0, abs=1e-15)
    still, moving = found.branches
    assert verdicts(still) == ["stable", "unstable"]
    assert verdicts(moving) == ["unstable", "stable"]
    assert moving.positions[:, 0] == pytest.approx(moving.values, abs=1e-14)


@pytest.mark.slow
def test_fold_of_an_imperfect_pitchfork():
    """x³ - p x + s = 0 turns back at p = 3 (s/2)^(2/3), x = (s/2)^(1/3)."""
    found = branches(particle("x^4/4 - p*x^2/2 + 0.2*x"), p=(-1, 1))
    (mark,) = found.marks
    assert mark.kind == "fold"
    assert mark.value == pytest.approx(3 * 0.1 ** (2 / 3), rel=1e-15)
    assert mark.position == pytest.approx([0.1 ** (1 / 3)], rel=1e-15)
    assert [verdicts(b) for b in found.branches] == [["stable"], ["stable", "unstable"]]
    for branch in found.branches:
        x, p = branch.positions[:, 0], branch.values
        assert np.abs(x**3 - p * x + 0.2) == pytest.approx(0, abs=2e-15)


@pytest.mark.slow
@pytest.mark.parametrize(("damping", "expected"), [(0.0, 3.5 - 2**0.5), (0.1, 41 / 28 + 0.005)])
def test_flutter_of_zieglers_column(damping, expected):
    """P = (7/2 - √2) k/l without damping, (41/28) k/l + c²/(2 m l³) with it (Ziegler 1952)."""
    scene = load(SYSTEMS / "pendulums/zieglers_column.yaml", parameters={"c": damping})
    found = branches(scene, P=(0, 4))
    (mark,) = found.marks
    assert mark.kind == "flutter"
    assert mark.value == pytest.approx(expected, rel=4e-16)
    stable, unstable = verdicts(found.branches[0])
    assert stable == ("asymptotically stable" if damping else "stable in the linear approximation")
    assert unstable == "unstable"
    if not damping:
        assert mark.frequency == pytest.approx(0.5**0.25, rel=1e-14)


@pytest.mark.slow
def test_flutter_load_by_another_route():
    """Of the characteristic polynomial 2 w² - (7 - 2 P) w + 1 the discriminant vanishes there."""
    found = branches(load(SYSTEMS / "pendulums/zieglers_column.yaml"), P=(0, 4))
    value = found.marks[0].value
    mass, stiffness = np.array([[3, 1], [1, 1]]), np.array([[2 - value, value - 1], [-1, 1]])
    squares = np.linalg.eigvals(np.linalg.solve(mass, stiffness))
    assert abs(squares[0] - squares[1]) < 1e-7
    assert squares.real == pytest.approx(math.sqrt(0.5), abs=1e-7)


@pytest.mark.slow
def test_isola_is_a_closed_loop_with_two_folds():
    """x² + (p - 1)² = 1/4."""
    found = branches(particle(force="{f: {on: x, force: 0.25 - x^2 - (p - 1)^2}}"), p=(0, 2))
    (loop,) = found.branches
    assert loop.ends == ("closed", "closed")
    assert [(m.kind, round(m.value, 14)) for m in found.marks] == [("fold", 0.5), ("fold", 1.5)]
    assert len(loop.stretches) == 2
    text = loads(particle(force="{f: {on: x, force: 0.25 - x^2 - (p - 1)^2}}")).derive()
    shown = text.analyze(branches={"p": (0, 2)}).text(width=120)
    assert "0.5 to 1.5  0 over 0.4" in shown
    assert "a closed loop" in shown
    assert (loop.values[0], loop.positions[0, 0]) == (loop.values[-1], loop.positions[-1, 0])
    assert loop.positions[:, 0] ** 2 + (loop.values - 1) ** 2 == pytest.approx(0.25, abs=1e-15)


@pytest.mark.slow
def test_folds_and_pitchfork_on_one_branch():
    """x (x⁴ - 2 x² + p) = 0: a pitchfork at 0, folds at p = 1, x = ±1."""
    found = branches(particle("x^6/6 - x^4/2 + p*x^2/2"), p=(-0.5, 1.5))
    assert sorted((m.kind, m.value, round(m.position[0], 12)) for m in found.marks) == [
        ("fold", 1, -1),
        ("fold", 1, 1),
        ("pitchfork", 0, 0),
    ]
    curve = found.branches[1]
    assert verdicts(curve) == ["stable", "unstable", "unstable", "stable"]


@pytest.mark.slow
def test_pitchfork_between_coupled_coordinates():
    """K = [[-p, s], [s, 1]] is singular at p = -s²."""
    scene = particle("x^4/4 - p*x^2/2 + y^2/2 + x*y/5", coordinates="x, y")
    found = branches(scene, p=(-1, 1))
    (mark,) = found.marks
    assert mark.kind == "pitchfork"
    # The value is a double: its error is no less than the rounding of that.
    assert abs(Fraction(mark.value) + Fraction(1, 25)) <= mark.error < 1e-16


@pytest.mark.slow
def test_several_eigenvalues_that_vanish_at_once():
    """A bowl with the symmetry of rotation: the determinant does not change its sign."""
    scene = particle("(x^2 + y^2)^2/4 - p*(x^2 + y^2)/2", coordinates="x, y")
    found = branches(scene, p=(-1, 1))
    assert kinds(found) == ["divergence"]
    assert found.marks[0].value == pytest.approx(0, abs=1e-15)
    assert verdicts(found.branches[0]) == ["stable", "unstable"]
    assert found.skipped


@pytest.mark.slow
def test_line_of_equilibria_at_one_value():
    """p x = 0: at p = 0 every x is an equilibrium; that is no pitchfork, and has no end."""
    found = branches(particle("p*x^2/2"), p=(-1, 1))
    assert kinds(found) == ["branch point"]
    line = found.branches[1]
    assert line.ends == ("far", "far")
    assert np.abs(line.values).max() == 0
    assert verdicts(line) == ["undecided", "undecided"]


@pytest.mark.slow
def test_branch_that_ends_where_forces_do():
    """x (1 + p/√(1 - x²)) = 0 ends at x = ±1, where p = 0."""
    found = branches(particle("x^2/2 - p*sqrt(1 - x^2)"), p=(-2, 3))
    curve = found.branches[1]
    assert curve.ends == ("singular", "singular")
    assert curve.values[[0, -1]] == pytest.approx(0, abs=1e-6)
    assert np.abs(curve.positions[[0, -1], 0]) == pytest.approx(1, abs=1e-9)


@pytest.mark.slow
def test_fold_at_the_end_of_the_range():
    found = branches(particle("x^3/3 - p*x"), p=(0, 1))
    assert kinds(found) == ["fold"]
    assert found.marks[0].value == pytest.approx(0, abs=1e-15)


def test_no_branch_where_there_is_no_equilibrium():
    found = branches(particle("x^3/3 - p*x"), p=(-2, -1))
    assert found.branches == ()


@pytest.mark.slow
def test_neighbouring_branches_are_not_confused():
    """(x² - p² - s²)(x - 2) = 0: branches pass each other at a distance of 2 s = 1/50."""
    force = "{f: {on: x, force: (x^2 - p^2 - 0.0001)*(2 - x)}}"
    found = branches(particle(force=force), p=(-1, 1))
    assert not found.marks
    for branch in found.branches:
        x, p = branch.positions[:, 0], branch.values
        sheet = [np.abs(x - y).max() for y in (np.hypot(p, 0.01), -np.hypot(p, 0.01), 2)]
        assert min(sheet) < 1e-14
    assert len(found.branches) == 3


@pytest.mark.slow
def test_points_of_branches_obey_the_search(tmp_path):
    """Every equilibrium that a search finds at another value lies on a branch."""
    derivation = load(SYSTEMS / "pendulums/coupled_pendulums.yaml").derive()
    name = derivation.equations.system.parameters[-1].name
    value = derivation.equations.system.parameters[-1].value
    found = derivation.analyze(branches={name: (0.5 * value, 1.5 * value)}).branches
    points = derivation.analyze("equilibria").equilibria.points
    for point in points:
        position = [float(x) for x in point.position]
        gaps = [
            np.abs(np.array([np.interp(value, *pair) for pair in columns(b)]) - position).max()
            for b in found.branches
        ]
        assert min(gaps) < 1e-3


def columns(branch):
    order = np.argsort(branch.values)
    return [
        (branch.values[order], branch.positions[order, k]) for k in range(branch.positions.shape[1])
    ]


def test_parameters_that_follow_another_one_vary_with_it():
    """With k = 2 p the fold of x² = k is that of x² = 2 p, and one of k alone is not."""
    scene = particle("x^3/3 - k*x", parameters=", k: 2*p")
    found = branches(scene, p=(0.5, 1))
    assert np.abs(found.branches[0].positions[:, 0]) == pytest.approx(
        np.sqrt(2 * found.branches[0].values), abs=1e-15
    )


@pytest.mark.slow
def test_constraints_kept_beside_coordinates():
    """A pendulum in Cartesian coordinates hangs at z = -l and stands at z = l."""
    scene = load(SYSTEMS / "constraints/pendulum_in_cartesian_coordinates.yaml")
    found = branches(scene, l=(0.5, 2))
    assert sorted(verdicts(b)[0] for b in found.branches) == ["stable", "unstable"]
    for branch in found.branches:
        assert np.abs(branch.positions[:, 1]) == pytest.approx(branch.values, rel=1e-15)


@pytest.mark.slow
def test_text_documents_and_json_tell_the_same():
    analysis = (
        load(SYSTEMS / "beads/bead_on_rotating_hoop.yaml")
        .derive()
        .analyze(branches={"omega": (0, 12)})
    )
    report = analysis.report()["branches"]
    assert (report["parameter"], report["from"], report["to"]) == ("omega", 0, 12)
    assert [mark["kind"] for mark in report["marks"]] == ["pitchfork"]
    assert len(report["curves"]) == 3
    curve = report["curves"][1]
    assert curve["ends"] == ["range", "range"]
    assert [s["stability"] for s in curve["stretches"]] == ["stable", "stable"]
    assert curve["stretches"][0]["last"] == curve["marks"][0]["point"]
    text = analysis.text()
    assert "1       pitchfork  5.718391382198" in text
    for to, language in itertools.product(
        ("latex", "markdown", "typst", "html"), ("en", "de", "fr")
    ):
        (document,) = analysis.emit(to, language=language).values()
        assert "5.718391382198" in document


@pytest.mark.slow
def test_picture(tmp_path):
    pytest.importorskip("matplotlib")
    analysis = (
        load(SYSTEMS / "beads/bead_on_rotating_hoop.yaml")
        .derive()
        .analyze(branches={"omega": (0, 12)})
    )
    analysis.plot(tmp_path / "hoop.svg")
    analysis.plot(tmp_path / "hoop.tex")
    assert "1 pitchfork" in (tmp_path / "hoop.tex").read_text()
    assert (tmp_path / "hoop.tex").read_text().count("addlegendentry") == 2
    with pytest.raises(InputError, match="no branches"):
        load(SYSTEMS / "pendulums/pendulum.yaml").derive().analyze("modes").plot("x.tex")


@pytest.mark.parametrize(
    ("over", "message"),
    [
        ({"q": (0, 1)}, "'q' is no parameter"),
        ({"x": (0, 1)}, "'x' is a coordinate"),
        ({"p": (1, 1)}, "both ends of the range of p are one"),
        ({"p": (math.nan, 1)}, "nan"),
        ({"p": (0, math.inf)}, "inf"),
        ({"p": (0, "x")}, "no number"),
        ({"p": (0, "1/0")}, "division by zero"),
        ({"p": (0, "1 +")}, "expected"),
    ],
)
def test_ranges_that_are_refused(over, message):
    with pytest.raises(InputError, match=message):
        branches(particle("x^3/3 - p*x"), **over)


def test_sizes_and_unused_and_positive_parameters_are_refused():
    chain = load(SYSTEMS / "chains/pendulum_chain.yaml").derive()
    size = chain.equations.presentation.sizes[0][0]
    with pytest.raises(InputError, match="is a size"):
        chain.analyze(branches={size: (1, 4)})
    unused = particle("x^3/3 - p*x", parameters=", s: 1")
    with pytest.raises(InputError, match="no equation of motion depends on 's'"):
        branches(unused, s=(0, 1))
    with pytest.raises(InputError, match="declares l positive"):
        branches(load(SYSTEMS / "pendulums/pendulum.yaml"), l=(-1, 1))


def test_systems_without_isolated_equilibria_are_refused():
    with pytest.raises(InputError, match="no force depends on a coordinate"):
        branches(particle("p*x"), p=(0, 1))
    with pytest.raises(InputError, match="constraints between velocities"):
        branches(load(SYSTEMS / "rolling/rolling_disk.yaml"), m=(1, 2))
    derivation = load(SYSTEMS / "pendulums/spherical_pendulum.yaml").derive()
    with pytest.raises(InputError, match="not of steady motions"):
        derivation.analyze(branches={"l": (1, 2)}, steady=True)


@pytest.mark.slow
@pytest.mark.parametrize("damping", [0.0, 0.1])
def test_root_loci_of_zieglers_column(damping):
    """Poles are the zeros of the characteristic polynomial, and move little between points."""
    scene = load(SYSTEMS / "pendulums/zieglers_column.yaml", parameters={"c": damping})
    (branch,) = branches(scene, P=(0, 6)).branches
    locus = branch.locus
    assert locus.poles.shape == (len(locus.values), 4)
    mass = np.array([[3, 1], [1, 1]])
    rub = damping * np.array([[2, -1], [-1, 1]])
    for value, poles in zip(locus.values, locus.poles, strict=True):
        stiffness = np.array([[2 - value, value - 1], [-1, 1]])
        for s in poles:
            assert abs(np.linalg.det(mass * s**2 + rub * s + stiffness)) < 1e-9
    assert np.abs(np.diff(locus.poles, axis=0)).max() <= 0.0101 * np.abs(locus.poles).max()


@pytest.mark.slow
def test_poles_that_meet_at_zero_are_followed_beyond():
    """ω² R² - g R: two poles on the imaginary axis, then two on the real one."""
    found = branches(load(SYSTEMS / "beads/bead_on_rotating_hoop.yaml"), omega=(0, 12))
    bottom = found.branches[0].locus
    expected = np.emath.sqrt(bottom.values**2 - 9.81 / 0.3)
    away = np.abs(expected) > 0.05
    squares = bottom.poles[away] ** 2
    assert squares == pytest.approx(np.stack([expected[away] ** 2] * 2, axis=1), rel=1e-9)
    assert bottom.poles.sum(axis=1) == pytest.approx(0, abs=1e-6)


@pytest.mark.slow
def test_pictures_of_loci(tmp_path):
    found = (
        load(SYSTEMS / "pendulums/zieglers_column.yaml").derive().analyze(branches={"P": (0, 6)})
    )
    found.plot_loci(tmp_path / "loci.tex")
    told = (tmp_path / "loci.tex").read_text()
    assert told.count(r"\addplot") == 5
    assert "1 flutter" in told
    assert "P = 6" in told


@pytest.mark.slow
def test_a_pole_is_no_branch_point():
    """K = 2/p passes infinity at p = 0, where nothing meets."""
    found = branches(load(DEFECTS / "false_branch_point_at_pole.yaml"), p=(-1, 1))
    assert not found.marks
    assert [b.ends for b in found.branches] == [("range", "pole"), ("pole", "range")]
    assert [verdicts(b) for b in found.branches] == [["unstable"], ["stable"]]


@pytest.mark.slow
@pytest.mark.parametrize("power", [3, 5])
def test_a_cusp_is_where_two_branches_end(power):
    """x² = p³: both halves end near p = 0, and no point is marked."""
    text = (DEFECTS / "cusp_branch_points_error.yaml").read_text()
    found = branches(text.replace("p^3", f"p^{power}"), p=(-1, 1))
    assert not found.marks
    for branch in found.branches:
        x, p = branch.positions[:, 0], branch.values
        assert np.abs(x) == pytest.approx(p ** (power / 2), rel=1e-9, abs=1e-12)
        assert np.sign(x).min() == np.sign(x).max()
        assert sorted(branch.ends) == ["range", "stuck"]
    assert sorted(verdicts(b) for b in found.branches) == [["stable"], ["unstable"]]


@pytest.mark.slow
def test_a_fold_of_higher_order_lies_within_its_error():
    """x⁴ = p turns back at 0, where x³ vanishes, too."""
    found = branches(particle("x^5/5 - p*x"), p=(-1, 1.1))
    (mark,) = found.marks
    assert mark.kind == "fold"
    assert abs(mark.value) <= mark.error < 1e-8


@pytest.mark.slow
@pytest.mark.parametrize("power", [4, 6])
def test_points_within_the_error_of_a_mark_belong_to_no_part(power):
    """(x - 0.74)ⁿ = p: points of the unstable part beside the fold lie beyond it as told."""
    found = branches(
        particle(f"(x - 0.74)^{power + 1}/{power + 1} - p*(x - 0.74)"), p=(-1.03, 1.31)
    )
    (mark,) = found.marks
    (branch,) = found.branches
    assert verdicts(branch) == ["stable", "unstable"]
    for stretch, side in zip(branch.stretches, (1, -1), strict=True):
        part = slice(stretch.first, stretch.last + 1)
        assert (side * (branch.positions[part, 0] - 0.74) > 0).all()
        assert (np.abs(branch.values[part] - mark.value) > mark.error).all()


@pytest.mark.slow
def test_branches_that_all_but_meet_do_not():
    """x³ − p x + 1e-9 = 0: a fold beside a branch that misses it by 1e-3."""
    found = branches(particle("x^4/4 - p*x^2/2 + 1e-9*x"), p=(-1, 1.1))
    assert kinds(found) == ["fold"]
    assert found.marks[0].value == pytest.approx(3 * 5e-10 ** (2 / 3), rel=1e-12)


@pytest.mark.parametrize(
    ("potential", "ends", "value", "number"),
    [
        ("x^4/4 - p*x^2/2", (0, 1), 0, 2),
        ("x^4/4 - p*x^2/2", (-1, 0), 0, 1),
        ("cos(x) + p*x^2/2", (0.2, 1), 1, 2),
    ],
)
def test_a_pitchfork_at_an_end_of_the_range_is_marked(potential, ends, value, number):
    check_pitchfork_at_an_end(branches(particle(potential), p=ends), ends, value, number)


def test_what_lies_at_the_low_end_of_a_positive_parameter_is_seen():
    """Its logarithm has a value a little below the end, though the range is many times as wide."""
    scene = particle("x^4/4 - log(4*s)*x^2/2", parameters=", s: {value: 1, positive: true}")
    found = branches(scene, s=(0.25, 100))
    check_pitchfork_at_an_end(found, (0.25, 100), 0.25, 2)


def check_pitchfork_at_an_end(found, ends, value, number):
    (mark,) = found.marks
    assert (mark.kind, len(found.branches)) == ("pitchfork", number)
    assert abs(mark.value - value) <= mark.error
    assert all(branch.ends == ("range", "range") for branch in found.branches)
    values = [x for branch in found.branches for x in branch.values]
    assert (min(values), max(values)) == ends
