"""Whipple's bicycle by rotation matrices: no component is typed.

J. P. Meijaard, J. M. Papadopoulos, A. Ruina and A. L. Schwab, Proc. R. Soc. A 463 (2007) 1955.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import SimpleNamespace

from sympy import Expr, Matrix, Rational, cos, diff, sin, sqrt

Names = SimpleNamespace

HALF = Rational(1, 2)
DOWN = Matrix([0, 0, 1])


def _turn(axis: int, angle: Expr) -> Matrix:
    """A turn about a coordinate axis."""
    i, j = [k for k in range(3) if k != axis]
    if axis == 1:
        i, j = j, i
    turn = Matrix.eye(3)
    turn[i, i] = turn[j, j] = cos(angle)
    turn[i, j], turn[j, i] = -sin(angle), sin(angle)
    return turn


def _rate(matrix: Matrix, q: Names, v: Names) -> Matrix:
    pairs = [(getattr(q, name), getattr(v, name)) for name in vars(q)]
    return matrix.applyfunc(lambda e: sum((diff(e, x) * rate for x, rate in pairs), 0 * e))


def _spin(turn: Matrix, q: Names, v: Names) -> Matrix:
    """The angular velocity along the body's axes, from RᵀṘ."""
    skew = turn.T * _rate(turn, q, v)
    return Matrix([skew[2, 1], skew[0, 2], skew[1, 0]])


class _Bicycle:
    """Orientations and centres, from the contact of the rear wheel on."""

    def __init__(self, p: Names, q: Names) -> None:
        self.lean = _turn(2, q.psi) * _turn(0, q.phi)
        self.frame = self.lean * _turn(1, q.theta)
        steer = _turn(1, p.tilt) * _turn(2, q.delta) * _turn(1, -p.tilt)
        self.fork = self.frame * steer
        contact = Matrix([q.x, q.y, 0])
        self.rear = contact - p.rR * self.lean[:, 2]
        self.body = self.rear + self.frame * Matrix([p.xB, 0, p.zB + p.rR])
        axis = self.rear + self.frame * Matrix([p.w + p.c, 0, p.rR])
        self.handle = axis + self.fork * Matrix([p.xH - p.w - p.c, 0, p.zH])
        self.front = axis + self.fork * Matrix([-p.c, 0, -p.rF])
        across = self.fork[:, 1]
        self.to_ground = p.rF * (DOWN - across[2] * across) / sqrt(1 - across[2] ** 2)


def _rotation(inertia: Matrix, spin: Matrix) -> Expr:
    return HALF * (spin.T * inertia * spin)[0]


def lagrangian(p: Names, q: Names, v: Names) -> Expr:
    b = _Bicycle(p, q)
    centres = [(p.mR, b.rear), (p.mB, b.body), (p.mH, b.handle), (p.mF, b.front)]
    energy = sum(
        HALF * m * (_rate(r, q, v).T * _rate(r, q, v))[0] + m * p.g * r[2] for m, r in centres
    )
    body = Matrix([[p.IBx, 0, p.IBxz], [0, p.IBy, 0], [p.IBxz, 0, p.IBz]])
    handle = Matrix([[p.IHx, 0, p.IHxz], [0, p.IHy, 0], [p.IHxz, 0, p.IHz]])
    rear, front = (Matrix.diag(a, c, a) for a, c in ((p.IRx, p.IRy), (p.IFx, p.IFy)))
    of_fork = _spin(b.fork, q, v)
    energy += _rotation(rear, _spin(b.lean, q, v) + Matrix([0, v.alpha, 0]))
    energy += _rotation(body, _spin(b.frame, q, v)) + _rotation(handle, of_fork)
    return energy + _rotation(front, of_fork + Matrix([0, v.beta, 0]))


def touch(p: Names, q: Names) -> list[Expr]:
    b = _Bicycle(p, q)
    return [(b.front + b.to_ground)[2]]


def rolling(p: Names, q: Names, v: Names) -> list[Expr]:
    """The points of the wheels that touch the ground are at rest."""
    b = _Bicycle(p, q)
    wheels = [
        (b.rear, b.lean, _spin(b.lean, q, v) + Matrix([0, v.alpha, 0]), p.rR * b.lean[:, 2]),
        (b.front, b.fork, _spin(b.fork, q, v) + Matrix([0, v.beta, 0]), b.to_ground),
    ]
    points = [_rate(r, q, v) + (turn * spin).cross(down) for r, turn, spin, down in wheels]
    return [point[k] for point in points for k in (0, 1)]


#: The benchmark's matrices of lean and steer: λ² M + λ v C1 + g K0 + v² K2 is singular.
MATRICES: Mapping[str, list[list[float]]] = {
    "M": [[80.81722, 2.31941332208709], [2.31941332208709, 0.29784188199686]],
    "C1": [[0, 33.86641391492494], [-0.85035641456978, 1.68540397397560]],
    "K0": [[-80.95, -2.59951685249872], [-2.59951685249872, -0.80329488458618]],
    "K2": [[0, 76.59734589573222], [0, 2.65431523794604]],
}
