"""The scene language evaluated with floats, straight from its syntax tree.

A route of its own for tests: it shares nothing with the package but the parser.
"""

import math

from lagrange_cli.errors import Mark
from lagrange_cli.scene import parse_expression
from lagrange_cli.scene.language.expression import Add, Call, Mul, Name, Neg, Number, Pow

_CALLS = {
    "sin": math.sin,
    "cos": math.cos,
    "tan": math.tan,
    "asin": math.asin,
    "acos": math.acos,
    "atan": math.atan,
    "atan2": math.atan2,
    "sinh": math.sinh,
    "cosh": math.cosh,
    "tanh": math.tanh,
    "asinh": math.asinh,
    "acosh": math.acosh,
    "atanh": math.atanh,
    "exp": math.exp,
    "log": math.log,
    "sqrt": math.sqrt,
    "abs": abs,
    "sign": lambda x: (x > 0) - (x < 0),
    "heaviside": lambda x: ((x > 0) - (x < 0) + 1) / 2,
    "min": min,
    "max": max,
}


def evaluate(text, values):
    """The value of a text where ``values`` maps ``x``, ``dot(x)``, ``ddot(x)`` to floats."""
    expression = parse_expression(text, Mark("<test>", 1, 1, text))
    return _value(expression.node, values)


def _value(node, values):
    if isinstance(node, Number):
        return float(node.value)
    if isinstance(node, Name):
        return math.pi if node.name == "pi" else values[node.name]
    if isinstance(node, Neg):
        return -_value(node.operand, values)
    if isinstance(node, Add):
        return math.fsum(
            _value(n, values) if sign == "+" else -_value(n, values) for sign, n in node.terms
        )
    if isinstance(node, Mul):
        result = 1.0
        for sign, factor in node.factors:
            value = _value(factor, values)
            result = result * value if sign == "*" else result / value
        return result
    if isinstance(node, Pow):
        return _value(node.base, values) ** _value(node.exponent, values)
    assert isinstance(node, Call)
    if node.function in ("dot", "ddot"):
        (name,) = node.arguments
        return values[f"{node.function}({name.name})"]
    return _CALLS[node.function](*(_value(a, values) for a in node.arguments))
