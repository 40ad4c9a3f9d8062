"""Stiff scenes: relaxation, strong damping, stiff springs; chains and nets of them."""

from __future__ import annotations

RELAXATION = """
name: relaxation
parameters: {mu: 1000}
coordinates: [x]
kinetic: {inertia: dot(x)^2/2}
potentials: {spring: x^2/2}
forces: {valve: {on: x, force: mu*(1 - x^2)*dot(x)}}
initial: {x: 2, dot(x): 0}
simulate: {until: 2000, samples: 201}
"""

OVERDAMPED = """
name: overdamped
particles: {m: {mass: 1, position: [x, 0, 0]}}
coordinates: [x]
potentials: {spring: x^2/2}
dissipation: {drag: 1e4*dot(x)^2/2}
initial: {x: 1}
simulate: {until: 9, samples: 11}
"""

SPRING_PENDULUM = """
name: spring_pendulum
parameters: {m: 1, l: 1, k: 1e10, c: 1e6, g: 9.81}
coordinates: [x, z]
particles: {bob: {mass: m, position: [x, 0, z]}}
potentials: {weight: m*g*z, spring: k*(sqrt(x^2 + z^2) - l)^2/2}
dissipation: {damper: c*(x*dot(x) + z*dot(z))^2/(x^2 + z^2)/2}
initial: {x: 0.6, z: -0.8, dot(x): 0, dot(z): 0}
simulate: {until: 2, samples: 101}
"""

PENDULUM_CHAIN = """
name: pendulum_chain
sizes: {n: 32}
parameters: {m: 1, l: 0.5, g: 9.81, c: 1e4}
plane: xz
points: {"p[0]": [0, 0, 0]}
particles: {"p[i=1..n]": {mass: m, position: ["x[i]", 0, "z[i]"]}}
coordinates: ["theta[i=1..n]"]
definitions:
  x[i=1..n]: sum(l*sin(theta[j]), j=1..i)
  z[i=1..n]: -sum(l*cos(theta[j]), j=1..i)
potentials: {weight: {gravity: g}}
dissipation:
  hinge[i=2..n]: c*(dot(theta[i]) - dot(theta[i-1]))^2/2
  first: c*dot(theta[1])^2/2
initial:
  theta[i=1..n]: pi/3
  dot(theta[i=1..n]): 0
simulate: {until: 100, samples: 101}
"""

SPRING_CHAIN = """
name: spring_chain
sizes: {n: N}
parameters: {m: 1, l: 0.5, k: 1e8, c: 1e5, g: 9.81}
plane: xz
points: {"p[0]": [0, 0, 0]}
particles: {"p[i=1..n]": {mass: m, position: ["x[i]", 0, "z[i]"]}}
coordinates: ["x[i=1..n]", "z[i=1..n]"]
definitions: {"x[0]": 0, "z[0]": 0}
potentials:
  weight: {gravity: g}
  rod[i=1..n]: {spring: ["p[i-1]", "p[i]"], stiffness: k, length: l}
dissipation:
  damper[i=1..n]: >-
    c*((x[i] - x[i-1])*(dot(x[i]) - dot(x[i-1])) + (z[i] - z[i-1])*(dot(z[i]) - dot(z[i-1])))^2
    /((x[i] - x[i-1])^2 + (z[i] - z[i-1])^2)/2
initial:
  x[i=1..n]: 0.3*i
  z[i=1..n]: -0.4*i
  dot(x[i=1..n]): 0
  dot(z[i=1..n]): 0
simulate: {until: 1, samples: 101}
"""

BEADS = """
name: beads
sizes: {n: N}
parameters: {m: 1e-4, k: 1e3, c: 1, b: 1e3}
particles: {"p[i=1..n]": {mass: m, position: ["x[i]", 0, 0]}}
coordinates: ["x[i=1..n]"]
definitions: {"x[0]": 0, "x[n+1]": 0}
potentials:
  spring[i=0..n]: k*(x[i+1] - x[i])^2/2 + b*(x[i+1] - x[i])^4/4
dissipation: {"drag[i=1..n]": "c*dot(x[i])^2/2"}
initial:
  x[i=1..n]: 0.5*sin(3*pi*i/(n + 1))
  dot(x[i=1..n]): 0
simulate: {until: 10, samples: 101}
"""

NET = """
name: net
sizes: {n: N}
parameters: {m: 1e-3, k: 1e4, l: 0.8, c: 10}
particles: {"p[i=1..n, j=1..n]": {mass: m, position: ["x[i,j]", "y[i,j]", "u[i,j]"]}}
points:
  p[0, j=1..n]: [0, j, 0]
  p[n+1, j=1..n]: [n + 1, j, 0]
  p[i=1..n, 0]: [i, 0, 0]
  p[i=1..n, n+1]: [i, n + 1, 0]
coordinates: ["x[i=1..n, j=1..n]", "y[i=1..n, j=1..n]", "u[i=1..n, j=1..n]"]
potentials:
  along[i=0..n, j=1..n]: {spring: ["p[i,j]", "p[i+1,j]"], stiffness: k, length: l}
  across[i=1..n, j=0..n]: {spring: ["p[i,j]", "p[i,j+1]"], stiffness: k, length: l}
dissipation:
  drag[i=1..n, j=1..n]: c*(dot(x[i,j])^2 + dot(y[i,j])^2 + dot(u[i,j])^2)/2
initial:
  x[i=1..n, j=1..n]: i
  y[i=1..n, j=1..n]: j
  u[i=1..n, j=1..n]: sin(pi*i/(n + 1))*sin(pi*j/(n + 1))
  dot(x[i=1..n, j=1..n]): 0
  dot(y[i=1..n, j=1..n]): 0
  dot(u[i=1..n, j=1..n]): 0
simulate: {until: 1, samples: 101}
"""

#: Name → text.
SCENES = {
    "relaxation": RELAXATION,
    "overdamped": OVERDAMPED,
    "spring pendulum": SPRING_PENDULUM,
    "pendulum chain": PENDULUM_CHAIN,
    "spring chain": SPRING_CHAIN.replace("N}", "16}"),
    "longer spring chain": SPRING_CHAIN.replace("N}", "64}"),
    "beads": BEADS.replace("N}", "64}"),
    "more beads": BEADS.replace("N}", "256}"),
    "net": NET.replace("N}", "6}"),
}
