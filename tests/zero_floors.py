"""Scenes with floors and walls beside closures, anywhere or exactly where a coordinate is 0."""

from __future__ import annotations

#: Two masses on a rod, each above a floor.
ROD = """
name: rod_on_a_floor
parameters: {{m: 1, l: 1, g: 9.81}}
plane: xz
particles: {{a: {{mass: m, position: [xa, 0, za]}}, b: {{mass: m, position: [xb, 0, zb]}}}}
coordinates: [xa, za, xb, zb]
constraints:
  rod: {{distance: [a, b], equals: l}}
  fa: za >= {0}
  fb: zb >= {0}
potentials: {{w: {{gravity: g}}}}
initial: {{xa: 0, za: {0}, xb: 0.6, zb: 0.8 + {0}}}
simulate: {{until: 0.3, accuracy: 1e-8}}
"""

#: A trebuchet whose shot slides on the ground: one rate is an angle's.
TREBUCHET = """
name: trebuchet
parameters: {{M: 100, m: 1, a: 1, b: 4, s: 3, h: 3, g: 9.81}}
plane: xz
coordinates: [th, x, z]
particles:
  weight: {{mass: M, position: [a*sin(th), 0, h + {0} - a*cos(th)]}}
  shot: {{mass: m, position: [x, 0, z]}}
points: {{tip: [-b*sin(th), 0, h + {0} + b*cos(th)]}}
constraints:
  sling: (x - x_tip)^2 + (z - z_tip)^2 = s^2
  ground: z >= {0}
potentials: {{weight: {{gravity: g}}}}
initial: {{th: 2.2, z: {0}}}
near: {{x: 0}}
simulate: {{until: 1, accuracy: 1e-6}}
"""

#: A body that hangs on two cranks: its height is the only length.
CRANKS = """
name: cranks
parameters: {{m: 1, J: 0.5, a: 0.7, b: 0.4, g: 9.81}}
plane: xz
particles: {{body: {{mass: m, position: [x, 0, z]}}}}
coordinates: [th, phi, z]
constraints:
  track: x = 0
  joint: (z - {0}) + a*tanh((z - {0})/a) + a*(th + sin(th))/2 = b*(phi + sin(phi))
  floor: z >= {0}
kinetic: {{spin: J*dot(th)^2/2 + J*dot(phi)^2}}
potentials: {{w: {{gravity: g}}, spring: J*(th - phi)^2}}
initial: {{th: 0.4, dot(th): 0.3, z: {0}}}
near: {{phi: 0.5}}
simulate: {{until: 0.3, accuracy: 1e-8}}
"""

#: A beam on a floor: what couples it to the closure, of angles, is its inertia.
BEAM = """
name: beam
parameters: {{m: 1, M: 2, J: 0.1, a: 0.7, g: 9.81}}
plane: xz
particles:
  hub: {{mass: M, position: [x, 0, z]}}
  end: {{mass: m, position: [x + a*cos(th), 0, z + a*sin(th)]}}
coordinates: [th, phi, x, z]
constraints:
  gear: phi + sin(phi)/2 = 2*th + sin(th)
  floor: z >= {0}
kinetic: {{spin: J*dot(phi)^2/2}}
potentials: {{w: {{gravity: g}}}}
initial: {{th: 0.4, x: 0, z: {0}, dot(x): 0.2}}
near: {{phi: 0.5}}
simulate: {{until: 0.3, accuracy: 1e-8}}
"""

#: A ladder of two masses in a corner, both ends at once.
CORNER = """
name: corner
parameters: {{m: 1, l: 1, g: 9.81}}
plane: xz
particles: {{a: {{mass: m, position: [xa, 0, za]}}, b: {{mass: m, position: [xb, 0, zb]}}}}
coordinates: [xa, za, xb, zb]
constraints:
  rod: {{distance: [a, b], equals: l}}
  floor: za >= {0}
  wall: xb >= {0}
potentials: {{w: {{gravity: g}}}}
initial: {{xa: 0.6 + {0}, za: {0}, xb: {0}, zb: 0.8 + {0}}}
simulate: {{until: 0.3, accuracy: 1e-8}}
"""

#: Scene → coordinates that move with the floor.
SCENES = {
    "rod": (ROD, ("za", "zb")),
    "trebuchet": (TREBUCHET, ("z",)),
    "cranks": (CRANKS, ("z",)),
    "beam": (BEAM, ("z",)),
    "corner": (CORNER, ("xa", "za", "xb", "zb")),
}
