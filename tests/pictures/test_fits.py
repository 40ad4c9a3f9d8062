"""Pictures of fits: measurements, the motion in front of them, and residuals about zero."""

from __future__ import annotations

import numpy as np
import pytest

from lagrange_cli import loads
from lagrange_cli.pictures.drawing import picture_of

SCENE = """
name: oscillator
parameters: {m: 1, k: 4}
particles: {p: {mass: m, position: [x, 0, 0]}}
coordinates: [x]
potentials: {spring: k*x^2/2}
initial: {x: 1, dot(x): 0}
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("count", "style", "has_bars"), [(20, "bars", True), (150, "bars", False), (500, "dots", False)]
)
def test_measurements_motion_and_residuals(tmp_path, count: int, style: str, has_bars) -> None:
    t = np.linspace(0, 5, count)
    x = np.cos(2 * t) + 0.01 * np.random.default_rng(1).normal(size=count)
    rows = "\n".join(f"{time},{place},0.01" for time, place in zip(t, x, strict=True))
    (tmp_path / "data.csv").write_text(f"t,x,sigma(x)\n{rows}\n")
    fit = loads(SCENE).derive().fit(str(tmp_path / "data.csv"), ["k"])
    upper, lower = picture_of(fit).panels
    measured, fitted = upper.lines
    assert (measured.style, measured.errors is not None) == (style, has_bars)
    assert np.allclose(measured.y, x)
    assert (fitted.style, len(fitted.x) > 100) == ("line", True)
    residuals, zero, *deviations = lower.lines
    assert np.allclose(residuals.y, x - np.cos(np.sqrt(fit.values[0].value) * t), atol=1e-6)
    assert not zero.y.any()
    assert [line.y[0] for line in deviations] == ([] if has_bars else [-0.01, 0.01])
