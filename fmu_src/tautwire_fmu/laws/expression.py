"""Reads a formula as data: arithmetic of numbers, names out of a list and a few functions; nothing is ever executed.

    numbers, names, + - * / and unary -, x ** n with a whole n from -8 to 8, sin cos exp log sqrt tanh abs

Everything else is refused with its place. The tree is evaluated with the mathematics handed in, as laws are.
"""

import ast
import math
from typing import Any, Callable, Collection, Dict, List, Mapping, NamedTuple, Tuple

from .mathematics import Mathematics

LONGEST = 2000
DEEPEST = 40
LARGEST_POWER = 8
OPERATORS = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/"}
FUNCTIONS: Dict[str, Callable[[Mathematics], Callable[[Any], Any]]] = {
    "sin": lambda m: m.sin,
    "cos": lambda m: m.cos,
    "exp": lambda m: m.exp,
    "log": lambda m: m.log,
    "sqrt": lambda m: m.sqrt,
    "tanh": lambda m: m.tanh,
    "abs": lambda m: m.absolute,
}


class ExpressionError(ValueError):
    """A text that is no formula; carries where (a character, from 1), what is wrong, and how to mend it."""

    def __init__(self, place: int, problem: str, mend: str) -> None:
        self.place, self.problem, self.mend = place, problem, mend
        super().__init__(f"character {place}: {problem}; {mend}")


class Node(NamedTuple):
    """One operation on ``parts``: of ``number`` a float, of ``name`` a text, of ``power`` node and int, else nodes.

    Operations are ``number``, ``name``, ``power``, ``negative``, ``+ - * /`` and the functions by their names.
    """

    operation: str
    parts: Tuple[Any, ...]


NOTHING = Node("number", (math.nan,))


def read_expression(text: str, names: Collection[str]) -> Node:
    """The tree of a formula in some names.

    Raises ExpressionError, the first, where the text is anything else.
    """
    faults: List[ExpressionError] = []
    tree = _read(text, names, faults)
    if faults:
        raise min(faults, key=_place)
    return tree


def expression_faults(text: str, names: Collection[str]) -> Tuple[ExpressionError, ...]:
    """All for which a text is no formula in some names, from left to right; none where it is one."""
    faults: List[ExpressionError] = []
    try:
        _read(text, names, faults)
    except ExpressionError as error:
        return (error,)
    return tuple(sorted(faults, key=_place))


def _place(error: ExpressionError) -> int:
    return error.place


def _read(text: str, names: Collection[str], faults: List[ExpressionError]) -> Node:
    """The tree, of use where it adds nothing to the faults; raises ExpressionError where there is no tree at all."""
    if len(text) > LONGEST:
        raise ExpressionError(LONGEST, f"has {len(text)} characters, at most {LONGEST} are read", "write it shorter")
    strange = next((place for place, letter in enumerate(text) if not " " <= letter <= "~"), None)
    if strange is not None:
        # The parser takes letters that look alike for one another.
        mend = "use the letters and signs of plain ASCII, in one line"
        raise ExpressionError(strange + 1, f"has {text[strange]!r}", mend)
    try:
        body = ast.parse(text.strip(), mode="eval").body
    except SyntaxError as error:
        raise ExpressionError(error.offset or 1, f"is no formula ({error.msg})", "correct it there") from error
    except (ValueError, RecursionError, MemoryError) as error:
        raise ExpressionError(1, "cannot be read", "write it shorter and with fewer brackets") from error
    return _node(body, frozenset(names), DEEPEST, faults)


def evaluate(m: Mathematics, node: Node, values: Mapping[str, Any]) -> Any:
    """The value of a formula where its names have these values; what ``m`` raises, or ZeroDivisionError."""
    operation, parts = node
    if operation == "number":
        return parts[0]
    if operation == "name":
        return values[parts[0]]
    first = evaluate(m, parts[0], values)
    if operation == "power":
        return _power(first, parts[1])
    if operation == "negative":
        return -first
    if operation in FUNCTIONS:
        return FUNCTIONS[operation](m)(first)
    second = evaluate(m, parts[1], values)
    if operation == "+":
        return first + second
    if operation == "-":
        return first - second
    return first * second if operation == "*" else first / second


def names_in(node: Node) -> Tuple[str, ...]:
    """The names that a formula uses, each once, in its order."""
    if node.operation == "name":
        return (node.parts[0],)
    inner = (name for part in node.parts if isinstance(part, Node) for name in names_in(part))
    return tuple(dict.fromkeys(inner))


def _power(base: Any, exponent: int) -> Any:
    result = 1.0
    for _ in range(abs(exponent)):
        result = result * base
    return result if exponent >= 0 else 1.0 / result


def _node(found: ast.AST, names: Collection[str], depth: int, faults: List[ExpressionError]) -> Node:
    try:
        return _operation(found, names, depth, faults)
    except ExpressionError as error:
        faults.append(error)
        return NOTHING


def _operation(found: ast.AST, names: Collection[str], depth: int, faults: List[ExpressionError]) -> Node:
    if depth == 0:
        raise _refusal(found, f"is nested more than {DEEPEST} deep", "use fewer brackets, or multiply out")
    if isinstance(found, ast.Constant):
        return Node("number", (_number(found),))
    if isinstance(found, ast.Name):
        if found.id not in names:
            raise _refusal(found, f"{found.id[:40]!r} is no name here", f"use {', '.join(sorted(names))}")
        return Node("name", (found.id,))
    if isinstance(found, ast.UnaryOp) and isinstance(found.op, (ast.USub, ast.UAdd)):
        inner = _node(found.operand, names, depth - 1, faults)
        return Node("negative", (inner,)) if isinstance(found.op, ast.USub) else inner
    if isinstance(found, ast.BinOp) and isinstance(found.op, ast.Pow):
        base = _node(found.left, names, depth - 1, faults)
        return Node("power", (base, _exponent(found.right)))
    if isinstance(found, ast.BinOp) and type(found.op) in OPERATORS:
        parts = tuple(_node(side, names, depth - 1, faults) for side in (found.left, found.right))
        return Node(OPERATORS[type(found.op)], parts)
    if isinstance(found, ast.Call) and isinstance(found.func, ast.Name):
        parts = tuple(_node(argument, names, depth - 1, faults) for argument in found.args)
        if found.func.id in FUNCTIONS:
            if len(found.args) != 1 or found.keywords:
                raise _refusal(found, f"{found.func.id} takes one number", f"write {found.func.id}(...)")
            return Node(found.func.id, parts)
    raise _refusal(found, "is neither arithmetic nor a known function", f"use + - * / ** and {', '.join(FUNCTIONS)}")


def _number(found: ast.Constant) -> float:
    if isinstance(found.value, bool) or not isinstance(found.value, (int, float)):
        raise _refusal(found, "is no number", "write a number such as 2.5 or 1e-3")
    try:
        number = float(found.value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise _refusal(found, "is too large a number", "write one below 1e308")
    return number


def _exponent(found: ast.AST) -> int:
    negative = isinstance(found, ast.UnaryOp) and isinstance(found.op, ast.USub)
    inner = found.operand if isinstance(found, ast.UnaryOp) and negative else found
    whole = inner.value if isinstance(inner, ast.Constant) else None
    if isinstance(whole, bool) or not isinstance(whole, int) or whole > LARGEST_POWER:
        mend = f"write a whole number from -{LARGEST_POWER} to {LARGEST_POWER}, or use sqrt, exp and log"
        raise _refusal(found, "is no small whole power", mend)
    return -whole if negative else whole


def _refusal(found: ast.AST, problem: str, mend: str) -> ExpressionError:
    return ExpressionError(getattr(found, "col_offset", 0) + 1, problem, mend)
