"""What helpers of a family are written out to is what their texts would be read as."""

from __future__ import annotations

import time

import pytest

from lagrange_cli.scene import read_text
from lagrange_cli.scene.language.families import read_expression
from lagrange_cli.scene.language.templates import with_zero_indices

NET = """
sizes: {n: 12}
parameters: {m: 1, k: 2, "c[i=-1..n]": 3, l: 1}
plane: xz
particles:
  p[i=1..n, j=-1..1]: {mass: m, position: ["x[i,j]", "y[i,j]", "z[i,j]"]}
potentials:
  along[i=1..n-1, j=-1..1]: {spring: ["p[i,j]", "p[ i + 1, j]"], stiffness: STIFFNESS, length: l}
  across[i=1..n, j=-1..0]: {spring: ["p[i,j]", "p[i,j+1]"], stiffness: "k*(i - j)"}
"""


@pytest.mark.parametrize("stiffness", ["k", '"c[j]"', '"c[ j ]*i"', '"sum(c[s], s=1..i)"'])
def test_springs_of_a_family_are_read_as_their_texts(stiffness):
    scene = read_text(NET.replace("STIFFNESS", stiffness))
    assert len(scene.potentials) == 33 + 24
    for potential in scene.potentials:
        read = potential.expression
        assert read.node == read_expression(read.text, read.origin, exact=False).node
    assert "x_p[11,-1] - x_p[12,-1]" in scene.potentials[30].expression.text


def test_a_long_name_is_looked_at_once():
    started = time.process_time()
    assert with_zero_indices("a" * 20_000 + "*b[12,-3]") == "a" * 20_000 + "*b[00,-0]"
    assert time.process_time() - started < 0.05
