"""Numbers and rotations as the files have them, and as a person writes them.

Numbers are decimals as written. Angles that are π times a simple fraction in all their digits are
that: their sines and cosines are exact, and frames turned by right angles compose without rounding.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Context, Decimal
from fractions import Fraction
from itertools import product
from typing import TypeAlias

Vector: TypeAlias = tuple[Decimal, Decimal, Decimal]
Vector4: TypeAlias = tuple[Decimal, Decimal, Decimal, Decimal]
Matrix: TypeAlias = tuple[Decimal, ...]
"""Nine entries by rows."""

#: The arithmetic of an import: numbers that are no longer exact keep the digits of doubles.
ARITHMETIC = Context(prec=60)
_DOUBLE, _EXACT = 17, 25

PI = Decimal("3.14159265358979323846264338327950288419716939937510582097494459")

#: Denominators of fractions of π that are recognized from few digits, and from many.
_SIMPLE, _DEGREES = (1, 2, 3, 4, 6), (5, 9, 10, 12, 18, 20, 36, 60, 90, 180)
_FEW_DIGITS, _MANY_DIGITS = 5, 9

ZERO, ONE = Decimal(0), Decimal(1)
NO_VECTOR: Vector = (ZERO, ZERO, ZERO)
IDENTITY: Matrix = (ONE, ZERO, ZERO, ZERO, ONE, ZERO, ZERO, ZERO, ONE)
AXES = "xyz"


@dataclass(frozen=True)
class Angle:
    """An angle that does not change.

    Attributes
    ----------
    value
        In radians.
    part_of_pi
        The fraction of π that it is, None of another one.
    degrees
        In degrees where the file has those and the fraction is not simple.
    """

    value: Decimal
    part_of_pi: Fraction | None = None
    degrees: Decimal | None = None

    @property
    def text(self) -> str:
        """Write it in the language of scenes."""
        if self.part_of_pi is not None:
            return _multiple_of_pi(self.part_of_pi)
        if self.degrees is not None:
            return f"{number_text(self.degrees)}*pi/180"
        return number_text(self.value)

    @property
    def is_zero(self) -> bool:
        return self.value == 0

    def negated(self) -> Angle:
        part = None if self.part_of_pi is None else -self.part_of_pi
        return Angle(-self.value, part, None if self.degrees is None else -self.degrees)

    def cosine_and_sine(self) -> tuple[Decimal, Decimal]:
        """Return cos and sin, exact at right angles."""
        quarters = None if self.part_of_pi is None else 2 * self.part_of_pi
        if quarters is not None and quarters.denominator == 1:
            return ((ONE, ZERO), (ZERO, ONE), (-ONE, ZERO), (ZERO, -ONE))[int(quarters) % 4]
        turn = self.value % (2 * PI)
        return _series(turn, ONE, 0), _series(turn, turn, 1)


def _series(turn: Decimal, term: Decimal, order: int) -> Decimal:
    total = ZERO
    while abs(term) > Decimal("1e-60"):
        total += term
        order += 2
        term *= -turn * turn / (order * (order - 1))
    return total


def in_radians(value: Decimal) -> Angle:
    """Return an angle, as a fraction of π where all digits are those of one."""
    part = _part_of_pi(value)
    return Angle(value) if part is None else Angle(_radians(part), part)


def _radians(part: Fraction) -> Decimal:
    return PI * part.numerator / part.denominator


def _part_of_pi(value: Decimal) -> Fraction | None:
    digits, exponent = value.as_tuple().digits, value.as_tuple().exponent
    assert isinstance(exponent, int)
    if value == 0:
        return Fraction(0)
    known: tuple[int, ...] = _SIMPLE if len(digits) >= _FEW_DIGITS else ()
    known += _DEGREES if len(digits) >= _MANY_DIGITS else ()
    ratio = float(value) / math.pi
    for denominator in known:
        part = Fraction(round(ratio * denominator), denominator)
        # Half a unit of the last digit, or a whole one where digits were cut off.
        if part and abs(_radians(part) - value) < Decimal(1).scaleb(exponent):
            return part
    return None


def in_degrees(value: Decimal) -> Angle:
    """Return an angle that is given in degrees."""
    part = Fraction(value) / 180
    radians = PI * value / 180
    is_simple = part.denominator <= 360
    return Angle(radians, part if is_simple else None, None if is_simple else value)


def _multiple_of_pi(part: Fraction) -> str:
    sign = "-" if part < 0 else ""
    above, below = abs(part.numerator), part.denominator
    if above == 0:
        return "0"
    return f"{sign}{'' if above == 1 else f'{above}*'}pi{'' if below == 1 else f'/{below}'}"


def number_text(value: Decimal) -> str:
    """Write a number: with all its digits, or those of a double if it has been computed."""
    digits = value.normalize(ARITHMETIC)
    if len(digits.as_tuple().digits) > _EXACT:
        digits = value.normalize(Context(prec=_DOUBLE))
    if digits == 0:
        return "0"
    if -5 <= digits.adjusted() < 15:
        return format(digits, "f")
    mantissa = digits.scaleb(-digits.adjusted())
    return f"{format(mantissa, 'f')}e{digits.adjusted()}"


@dataclass(frozen=True)
class ConstantTurn:
    """A turn about an axis ``x``, ``y``, ``z`` or about a direction of any length, by an angle."""

    axis: str | Vector
    angle: Angle


def rotation(turns: Sequence[ConstantTurn]) -> Matrix:
    """Return the rotation matrix of successive turns, whose columns are the turned axes."""
    total = IDENTITY
    for turn in turns:
        total = composed(total, _about(turn))
    return total


def _about(turn: ConstantTurn) -> Matrix:
    cosine, sine = turn.angle.cosine_and_sine()
    if isinstance(turn.axis, str):
        k = AXES.index(turn.axis)
        i, j = (k + 1) % 3, (k + 2) % 3
        entries = [ZERO] * 9
        entries[4 * k] = ONE
        entries[4 * i], entries[4 * j] = cosine, cosine
        entries[3 * i + j], entries[3 * j + i] = -sine, sine
        return tuple(entries)
    axis = unit(turn.axis)
    a, b, c = axis
    hat = ((ZERO, -c, b), (c, ZERO, -a), (-b, a, ZERO))
    return tuple(
        (cosine if i == j else ZERO) + (1 - cosine) * axis[i] * axis[j] + sine * hat[i][j]
        for i, j in product(range(3), repeat=2)
    )


def composed(left: Matrix, right: Matrix) -> Matrix:
    return tuple(
        sum((left[3 * i + k] * right[3 * k + j] for k in range(3)), ZERO)
        for i, j in product(range(3), repeat=2)
    )


def transposed(matrix: Matrix) -> Matrix:
    return tuple(matrix[3 * j + i] for i, j in product(range(3), repeat=2))


def turned(matrix: Matrix, vector: Vector) -> Vector:
    """Return a vector of a frame's axes in those that the frame is turned against."""
    x, y, z = (sum((matrix[3 * i + k] * vector[k] for k in range(3)), ZERO) for i in range(3))
    return x, y, z


def added(left: Vector, right: Vector) -> Vector:
    return left[0] + right[0], left[1] + right[1], left[2] + right[2]


def scaled(vector: Vector, factor: Decimal) -> Vector:
    return vector[0] * factor, vector[1] * factor, vector[2] * factor


def unit(vector: Vector) -> Vector:
    """Return the direction of a vector that is not zero, exact along an axis."""
    if sum(part != 0 for part in vector) == 1:
        x, y, z = (part if part == 0 else ONE.copy_sign(part) for part in vector)
        return x, y, z
    length = sum((part * part for part in vector), ZERO).sqrt()
    return vector[0] / length, vector[1] / length, vector[2] / length


def is_square(matrix: Matrix) -> bool:
    """Tell whether a rotation only exchanges axes and reverses them: it rounds nothing."""
    return all(entry in (0, 1, -1) for entry in matrix)


_RIGHT_ANGLES = tuple(Angle(_radians(part), part) for part in map(Fraction, ("1/2", "1", "-1/2")))
_QUARTER_TURNS = tuple(ConstantTurn(axis, angle) for axis in AXES for angle in _RIGHT_ANGLES)


def fewest_turns(turns: tuple[ConstantTurn, ...]) -> tuple[ConstantTurn, ...]:
    """Leave out turns that do nothing; by right angles, as few as do the same."""
    present = tuple(turn for turn in turns if not turn.angle.is_zero)
    matrix = rotation(present)
    if not present or not is_square(matrix):
        return present
    for count in range(len(present)):
        for candidate in product(_QUARTER_TURNS, repeat=count):
            if rotation(candidate) == matrix:
                return candidate
    return present


def turns_of_square(matrix: Matrix) -> tuple[ConstantTurn, ...]:
    """Return the fewest turns of a rotation that only exchanges axes."""
    candidates = (c for count in range(3) for c in product(_QUARTER_TURNS, repeat=count))
    return next(candidate for candidate in candidates if rotation(candidate) == matrix)


def turn_of_quaternion(parts: Sequence[Decimal]) -> tuple[ConstantTurn, ...]:
    """Return the turns of a quaternion of any length but zero, its scalar first."""
    w, x, y, z = (Fraction(part) for part in parts)
    size = w * w + x * x + y * y + z * z
    rows = (
        *(w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)),
        *(2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)),
        *(2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z),
    )
    if all(abs(entry) in (0, size) for entry in rows):
        return turns_of_square(tuple(Decimal(int(entry / size)) for entry in rows))
    length = (Decimal(parts[1]) ** 2 + parts[2] ** 2 + parts[3] ** 2).sqrt()
    angle = in_radians_of_tangent(length, parts[0])
    return (turn_about((parts[1], parts[2], parts[3]), angle),)


def in_radians_of_tangent(length: Decimal, scalar: Decimal) -> Angle:
    """Return the angle of a quaternion, 2 atan2(length of its vector, scalar)."""
    # Newton's steps from the double: each has twice the digits.
    half = Decimal(math.atan2(length, scalar))
    size = (length * length + scalar * scalar).sqrt()
    for _ in range(3):
        cosine, sine = Angle(half).cosine_and_sine()
        half += (length * cosine - scalar * sine) / size
    value = 2 * half
    value = value - 2 * PI if value > PI else value
    return Angle(value)


def turn_about(axis: Vector, angle: Angle) -> ConstantTurn:
    """Return a turn about a direction, an axis of coordinates by its letter."""
    along = axis_letter(axis)
    if along is None:
        return ConstantTurn(axis, angle)
    letter, sign = along
    return ConstantTurn(letter, angle if sign > 0 else angle.negated())


def axis_letter(axis: Vector) -> tuple[str, int] | None:
    """Return the axis of coordinates that a direction is along, and its sign."""
    parts = [(letter, part) for letter, part in zip(AXES, axis, strict=True) if part != 0]
    if len(parts) != 1:
        return None
    letter, part = parts[0]
    return letter, 1 if part > 0 else -1


def turn_between(start: Vector, end: Vector) -> tuple[ConstantTurn, ...]:
    """Return the smallest turn that takes one direction to another."""
    a, b = unit(start), unit(end)
    across = crossed(a, b)
    along = sum((p * q for p, q in zip(a, b, strict=True)), ZERO)
    size = sum((p * p for p in across), ZERO).sqrt()
    if size == 0:
        return () if along > 0 else (ConstantTurn("x", _RIGHT_ANGLES[1]),)
    if along == 0:
        return (turn_about(across, _RIGHT_ANGLES[0]),)
    # tan of half the angle from the sine and the cosine.
    return (turn_about(across, in_radians_of_tangent(size, 1 + along)),)


def turn_of_axes(first: Vector, second: Vector) -> tuple[ConstantTurn, ...] | None:
    """Return the turns of a frame by its x axis and a direction in its plane of x and y."""
    if not any(first):
        return None
    x = unit(first)
    along = sum((p * q for p, q in zip(x, second, strict=True)), ZERO)
    rest_vector = added(second, scaled(x, -along))
    if not any(rest_vector):
        return None
    y = unit(rest_vector)
    z = crossed(x, y)
    matrix = (x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2])
    return turns_of_square(matrix) if is_square(matrix) else turn_of_quaternion(_quaternion(matrix))


def _quaternion(matrix: Matrix) -> Vector4:
    """Return the quaternion of a rotation by its largest part (S. W. Shepperd, 1978)."""
    trace = matrix[0] + matrix[4] + matrix[8]
    squares = [1 + trace, *(1 + 2 * matrix[4 * k] - trace for k in range(3))]
    largest = max(range(4), key=lambda k: squares[k])
    differences = [matrix[7] - matrix[5], matrix[2] - matrix[6], matrix[3] - matrix[1]]
    if largest == 0:
        return squares[0], differences[0], differences[1], differences[2]
    k = largest - 1
    parts = [differences[k], ZERO, ZERO, ZERO]
    for j in range(3):
        both = matrix[3 * k + j] + matrix[3 * j + k]
        parts[1 + j] = squares[largest] if j == k else both
    return parts[0], parts[1], parts[2], parts[3]


def crossed(left: Vector, right: Vector) -> Vector:
    return (
        left[1] * right[2] - left[2] * right[1],
        left[2] * right[0] - left[0] * right[2],
        left[0] * right[1] - left[1] * right[0],
    )
