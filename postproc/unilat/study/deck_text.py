"""Decks with ${parameters}: each is a name or a small sum, product or function of names."""

from __future__ import annotations

import ast
import math
import operator
import re

from ..results import ResultsError

PLACE = re.compile(r"\$\{([^{}]*)\}")
BINARY = {ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv, ast.Pow: operator.pow}
UNARY = {ast.UAdd: operator.pos, ast.USub: operator.neg}
FUNCTIONS = {name: getattr(math, name) for name in ("sqrt", "sin", "cos", "tan", "asin", "acos", "atan", "exp", "log", "radians",
                                                    "degrees")} | {"abs": abs, "min": min, "max": max}
CONSTANTS = {"pi": math.pi}


def filled(text: str, values: dict, name: str) -> str:
    """The deck with each ${...} replaced; comment lines stay as they are. `name` of the deck is for messages."""
    lines = text.splitlines(keepends=True)
    for number, line in enumerate(lines, start=1):
        if not line.startswith("**"):
            lines[number - 1] = PLACE.sub(lambda place: _written(place.group(1), values, f"{name}:{number}"), line)
    return "".join(lines)


def parameters(text: str) -> set[str]:
    """Names that a deck asks for."""
    names = set()
    for line in text.splitlines():
        for place in PLACE.findall("" if line.startswith("**") else line):
            try:
                names |= {node.id for node in ast.walk(ast.parse(place.strip(), mode="eval")) if isinstance(node, ast.Name)}
            except SyntaxError:
                pass        # told with its line when the deck is filled
    return names - set(FUNCTIONS) - set(CONSTANTS)


def _written(expression: str, values: dict, where: str) -> str:
    try:
        value = _value(ast.parse(expression.strip(), mode="eval").body, values)
    except ResultsError as problem:
        raise ResultsError(f"{where}: ${{{expression}}}: {problem}") from None
    except (SyntaxError, TypeError):
        raise ResultsError(f"{where}: ${{{expression}}} is not a name or a formula") from None
    except (ArithmeticError, ValueError) as problem:
        raise ResultsError(f"{where}: ${{{expression}}}: {problem}") from None
    return repr(value) if isinstance(value, float) else str(value)


def _value(node, values: dict):
    if isinstance(node, ast.Constant) and isinstance(node.value, (int, float)):
        return node.value
    if isinstance(node, ast.Name):
        if node.id in values:
            return values[node.id]
        if node.id in CONSTANTS:
            return CONSTANTS[node.id]
        raise ResultsError(f"no parameter '{node.id}' (known: {', '.join(values)})")
    if isinstance(node, ast.BinOp) and type(node.op) in BINARY:
        return BINARY[type(node.op)](_value(node.left, values), _value(node.right, values))
    if isinstance(node, ast.UnaryOp) and type(node.op) in UNARY:
        return UNARY[type(node.op)](_value(node.operand, values))
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in FUNCTIONS and not node.keywords:
        return FUNCTIONS[node.func.id](*(_value(argument, values) for argument in node.args))
    raise SyntaxError
