"""Units by name: their dimensions, and the factors by which their numbers differ.

Symbols and names are those of pint's default registry, as far as mechanics needs them
(https://pint.readthedocs.io). Angles count as numbers.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from typing import TypeAlias

Powers: TypeAlias = Mapping[str, Fraction]
"""Base unit, or factor of numbers, → its power."""

#: Base units of the SI.
BASES = ("kg", "m", "s", "A", "K", "mol", "cd")

#: Factors of numbers by name: a power of ten for prefixes, one of its own for other units.
_TEN = "ten"

_PREFIXES = {
    "quetta": 30,
    "ronna": 27,
    "yotta": 24,
    "zetta": 21,
    "exa": 18,
    "peta": 15,
    "tera": 12,
    "giga": 9,
    "mega": 6,
    "kilo": 3,
    "hecto": 2,
    "deca": 1,
    "deka": 1,
    "deci": -1,
    "centi": -2,
    "milli": -3,
    "micro": -6,
    "nano": -9,
    "pico": -12,
    "femto": -15,
    "atto": -18,
    "zepto": -21,
    "yocto": -24,
    "ronto": -27,
    "quecto": -30,
}
_PREFIX_SYMBOLS = {
    "Q": 30,
    "R": 27,
    "Y": 24,
    "Z": 21,
    "E": 18,
    "P": 15,
    "T": 12,
    "G": 9,
    "M": 6,
    "k": 3,
    "h": 2,
    "da": 1,
    "d": -1,
    "c": -2,
    "m": -3,
    "u": -6,
    "µ": -6,
    "μ": -6,
    "n": -9,
    "p": -12,
    "f": -15,
    "a": -18,
    "z": -21,
    "y": -24,
    "r": -27,
    "q": -30,
}

#: Units of the SI and beside it that take prefixes: symbol, names, powers of :data:`BASES`, and a
#: power of ten.
_METRIC = """
    m meter,metre 0,1 0
    g gram 1 -3
    s second,sec 0,0,1 0
    A ampere,amp 0,0,0,1 0
    K kelvin 0,0,0,0,1 0
    mol mole 0,0,0,0,0,1 0
    cd candela 0,0,0,0,0,0,1 0
    rad radian 0 0
    sr steradian 0 0
    Hz hertz 0,0,-1 0
    N newton 1,1,-2 0
    Pa pascal 1,-1,-2 0
    J joule 1,2,-2 0
    W watt 1,2,-3 0
    C coulomb 0,0,1,1 0
    V volt 1,2,-3,-1 0
    F farad -1,-2,4,2 0
    Ohm ohm,Ω 1,2,-3,-2 0
    S siemens -1,-2,3,2 0
    Wb weber 1,2,-2,-1 0
    T tesla 1,0,-2,-1 0
    H henry 1,2,-2,-2 0
    L liter,litre,l 0,3 -3
    t tonne,metric_ton 1 3
    bar bar 1,-1,-2 5
    dyn dyne 1,1,-2 -5
    erg erg 1,2,-2 -7
    gauss gauss 1,0,-2,-1 -4
"""

#: Other units: names, powers of :data:`BASES`, and the factor to those.
_OTHERS = """
    min,minute 0,0,1 60
    h,hr,hour 0,0,1 3600
    d,day 0,0,1 86400
    week 0,0,1 604800
    year,yr,a 0,0,1 31557600
    deg,degree,° 0 0.017453292519943295
    arcmin,arcminute 0 0.0002908882086657216
    arcsec,arcsecond 0 4.84813681109536e-06
    turn,revolution,cycle 0 6.283185307179586
    rpm,revolutions_per_minute 0,0,-1 0.10471975511965977
    percent 0 0.01
    in,inch 0,1 0.0254
    ft,foot,feet 0,1 0.3048
    yd,yard 0,1 0.9144
    mi,mile 0,1 1609.344
    nmi,nautical_mile 0,1 1852
    angstrom,Å 0,1 1e-10
    au,astronomical_unit 0,1 149597870700
    ly,light_year,lightyear 0,1 9460730472580800
    pc,parsec 0,1 3.0856775814913672e16
    lb,pound 1 0.45359237
    oz,ounce 1 0.028349523125
    u,amu,dalton,Da 1 1.6605390666e-27
    lbf,pound_force 1,1,-2 4.4482216152605
    kgf,kilogram_force 1,1,-2 9.80665
    mph 0,1,-1 0.44704
    kph,kmh 0,1,-1 0.2777777777777778
    kt,knot 0,1,-1 0.5144444444444445
    psi 1,-1,-2 6894.757293168361
    atm,atmosphere 1,-1,-2 101325
    eV,electron_volt 1,2,-2 1.602176634e-19
    cal,calorie 1,2,-2 4.184
    hp,horsepower 1,2,-3 745.6998715822702
    e,elementary_charge 0,0,1,1 1.602176634e-19
"""

#: Longest unit that is read, in names, numbers and signs; each parenthesis is a call.
_MOST_TOKENS = 100

#: Superscripts as they are typed.
_RAISED = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")
_SUPERSCRIPT = re.compile("[⁰¹²³⁴⁵⁶⁷⁸⁹⁻]+")

#: Most characters of a number with its unit.
_LONGEST_VALUE = 100
#: A number before a unit, and an exponent without its sign, as in ``m/s2``.
_VALUE_AND_UNIT = re.compile(
    r"([-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?)\s*(?![eE][-+\d])([^\W\d].*)"
)
_BARE_EXPONENT = re.compile(r"(?<=[^\W\d])(?=-?\d)")

#: A number, a name, or a sign; blanks multiply.
_TOKEN = re.compile(r"\s*(?:(\d+)|([^\W\d]\w*|°)|(\*\*|[-*/^()·]))\s*")


@dataclass(frozen=True)
class UnknownUnitError(Exception):
    """A unit is none of the table, or its text is no product of powers.

    Attributes
    ----------
    symbol
        The unit's name; empty if the text cannot be read.
    """

    symbol: str = ""


@cache
def _table() -> dict[str, tuple[Powers, float]]:
    """Name → powers of bases and factors, and the factor of numbers to those of the bases."""
    table: dict[str, tuple[Powers, float]] = {}
    for line in _OTHERS.strip().splitlines():
        names, powers, factor = line.split()
        for name in names.split(","):
            table[name] = {**_powers(powers), f"×{names}": Fraction(1)}, float(factor)
    for line in _METRIC.strip().splitlines():
        symbol, names, powers, tens = line.split()
        words = [(p, k, name) for name in names.split(",") for p, k in _PREFIXES.items()]
        words += [(p, k, symbol) for p, k in _PREFIX_SYMBOLS.items()]
        words += [("", 0, name) for name in (symbol, *names.split(","))]
        for prefix, k, name in reversed(words):
            total = k + int(tens)
            scaled = {_TEN: Fraction(total)} if total else {}
            # Minutes are no milli-inches, hours no hecto-nothing: other units come first.
            table.setdefault(prefix + name, ({**_powers(powers), **scaled}, 10.0**total))
    return table


def _powers(text: str) -> dict[str, Fraction]:
    pairs = zip(BASES, text.split(","), strict=False)
    return {base: Fraction(power) for base, power in pairs if power != "0"}


def unit_names() -> list[str]:
    """List the symbols and names of units, without those that prefixes make."""
    rows = [line.split() for line in (_METRIC + _OTHERS).strip().splitlines()]
    metric = [name for row in rows if len(row) == 4 for name in (row[0], *row[1].split(","))]
    return [*metric, *(name for row in rows if len(row) == 3 for name in row[0].split(","))]


def factor_of(powers: Powers) -> float:
    """Return the product of the factors of numbers."""
    product = 1.0
    for key, power in powers.items():
        factor = 10.0 if key == _TEN else _table()[key[1:].split(",")[0]][1]
        product *= math.pow(factor, power)
    return product


def unit_powers(text: str) -> Powers:
    """Read a unit, such as ``kg m^2/s``.

    Raises
    ------
    UnknownUnitError
        It is none.
    """
    reader = _Reader(text)
    powers = reader.product()
    if reader.tokens:
        raise UnknownUnitError
    return {key: power for key, power in powers.items() if power}


def value_and_unit(text: str) -> tuple[str, str] | None:
    """Split ``9.81 m/s2`` into ``9.81`` and ``m/s^2``; None if it is no number with a unit.

    Degrees are none: their numbers differ from those of radians, which expressions take.
    """
    match = _VALUE_AND_UNIT.fullmatch(text.strip())
    if match is None or len(text) > _LONGEST_VALUE:
        return None
    unit = _BARE_EXPONENT.sub("^", match[2])
    try:
        powers = unit_powers(unit)
    except UnknownUnitError:
        return None
    return (match[1], unit) if not powers or any(base in powers for base in BASES) else None


def or_product(value: str, unit: str) -> str:
    """Return the end of a hint at a number with a unit that may be meant for a product."""
    return f", for a product {value}*{unit}" if unit.isidentifier() else ""


class _Reader:
    """Reads products of powers from the front of a list of tokens."""

    def __init__(self, text: str) -> None:
        plain = _SUPERSCRIPT.sub(lambda m: "^" + m.group().translate(_RAISED), text)
        self.tokens = [m.group().strip() for m in _TOKEN.finditer(plain)]
        if not self.tokens or _TOKEN.sub("", plain) or len(self.tokens) > _MOST_TOKENS:
            raise UnknownUnitError

    def next(self, *expected: str) -> str:
        """Take a token, if it is one of these."""
        fits = self.tokens and (not expected or self.tokens[0] in expected)
        return self.tokens.pop(0) if fits else ""

    def product(self) -> dict[str, Fraction]:
        total = self.power()
        while self.tokens and self.tokens[0] != ")":
            sign = -1 if self.next("*", "/", "·") == "/" else 1
            for key, power in self.power().items():
                total[key] = total.get(key, Fraction(0)) + sign * power
        return total

    def power(self) -> dict[str, Fraction]:
        if self.next("("):
            base = self.product()
            self.require(")")
        else:
            name = self.next()
            if name != "1" and name not in _table():
                raise UnknownUnitError(name if name[:1].isalpha() else "")
            base = {} if name == "1" else dict(_table()[name][0])
        exponent = self.exponent() if self.next("^", "**") else Fraction(1)
        return {key: power * exponent for key, power in base.items()}

    def exponent(self) -> Fraction:
        if self.next("("):
            value = self.number()
            if self.next("/"):
                divisor = self.number()
                if not divisor:
                    raise UnknownUnitError
                value /= divisor
            self.require(")")
            return value
        return self.number()

    def number(self) -> Fraction:
        sign = -1 if self.next("-") else 1
        digits = self.next()
        if not digits.isdecimal():
            raise UnknownUnitError
        return sign * Fraction(digits)

    def require(self, token: str) -> None:
        if not self.next(token):
            raise UnknownUnitError
