"""Parser and evaluator of arithmetic expressions; nothing is ever executed as Python.

    numbers, names, + - * / and unary -, x ** n with a whole n from -8 to 8, sin cos exp log sqrt tanh abs

Everything else is refused with its position. The syntax tree is evaluated with the mathematics passed in, as laws are.
"""

import ast
import math
from typing import Any, Callable, Collection, Dict, List, Mapping, NamedTuple, Tuple

from .mathematics import Mathematics

MAX_CHARACTERS = 2000
MAX_NESTING = 40
MAX_EXPONENT = 8
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
    """A text is no valid formula; carries the position (character, from 1), the problem, and a hint."""

    def __init__(self, position: int, problem: str, hint: str) -> None:
        self.position, self.problem, self.hint = position, problem, hint
        super().__init__(f"character {position}: {problem}; {hint}")


class ExpressionNode(NamedTuple):
    """Syntax-tree node; ``operands`` of number: a float, of name: a text, of power: node and int, else nodes.

    Operations are ``number``, ``name``, ``power``, ``negative``, ``+ - * /`` and the functions by their names.
    """

    operation: str
    operands: Tuple[Any, ...]


INVALID_NODE = ExpressionNode("number", (math.nan,))


def parse_expression(text: str, names: Collection[str]) -> ExpressionNode:
    """Parse a formula in some names into its syntax tree.

    Raises the first ExpressionError where the text is anything else.
    """
    errors: List[ExpressionError] = []
    tree = _parse(text, names, errors)
    if errors:
        raise min(errors, key=_error_position)
    return tree


def expression_errors(text: str, names: Collection[str]) -> Tuple[ExpressionError, ...]:
    """All syntax errors of a formula in some names, from left to right; empty where it is valid."""
    errors: List[ExpressionError] = []
    try:
        _parse(text, names, errors)
    except ExpressionError as error:
        return (error,)
    return tuple(sorted(errors, key=_error_position))


def _error_position(error: ExpressionError) -> int:
    return error.position


def _parse(text: str, names: Collection[str], errors: List[ExpressionError]) -> ExpressionNode:
    """Syntax tree, valid if it adds no errors; raises ExpressionError where there is no tree at all."""
    if len(text) > MAX_CHARACTERS:
        raise ExpressionError(
            MAX_CHARACTERS, f"has {len(text)} characters, at most {MAX_CHARACTERS} are read", "write it shorter"
        )
    index = next((place for place, letter in enumerate(text) if not " " <= letter <= "~"), None)
    if index is not None:
        # Python's parser normalises letters that look alike into one another.
        hint = "use the letters and signs of plain ASCII, in one line"
        raise ExpressionError(index + 1, f"has {text[index]!r}", hint)
    try:
        body = ast.parse(text.strip(), mode="eval").body
    except SyntaxError as error:
        raise ExpressionError(error.offset or 1, f"is no formula ({error.msg})", "correct it there") from error
    except (ValueError, RecursionError, MemoryError) as error:
        raise ExpressionError(1, "cannot be read", "write it shorter and with fewer brackets") from error
    return _read_node(body, frozenset(names), MAX_NESTING, errors)


def evaluate(m: Mathematics, node: ExpressionNode, values: Mapping[str, Any]) -> Any:
    """Value of a formula at given values of its names; raises what ``m`` raises, or ZeroDivisionError."""
    operation, operands = node
    if operation == "number":
        return operands[0]
    if operation == "name":
        return values[operands[0]]
    first_value = evaluate(m, operands[0], values)
    if operation == "power":
        return _power(first_value, operands[1])
    if operation == "negative":
        return -first_value
    if operation in FUNCTIONS:
        return FUNCTIONS[operation](m)(first_value)
    second_value = evaluate(m, operands[1], values)
    if operation == "+":
        return first_value + second_value
    if operation == "-":
        return first_value - second_value
    return first_value * second_value if operation == "*" else first_value / second_value


def variable_names(node: ExpressionNode) -> Tuple[str, ...]:
    """Names that a formula uses, each once, in its order."""
    if node.operation == "name":
        return (node.operands[0],)
    inner = (name for part in node.operands if isinstance(part, ExpressionNode) for name in variable_names(part))
    return tuple(dict.fromkeys(inner))


def _power(base: Any, exponent: int) -> Any:
    result = 1.0
    for _ in range(abs(exponent)):
        result = result * base
    return result if exponent >= 0 else 1.0 / result


def _read_node(
    syntax_node: ast.AST, names: Collection[str], levels_left: int, errors: List[ExpressionError]
) -> ExpressionNode:
    try:
        return _read_operation(syntax_node, names, levels_left, errors)
    except ExpressionError as error:
        errors.append(error)
        return INVALID_NODE


def _read_operation(
    syntax_node: ast.AST, names: Collection[str], levels_left: int, errors: List[ExpressionError]
) -> ExpressionNode:
    if levels_left == 0:
        raise _error_at(syntax_node, f"is nested more than {MAX_NESTING} deep", "use fewer brackets, or multiply out")
    if isinstance(syntax_node, ast.Constant):
        return ExpressionNode("number", (_read_number(syntax_node),))
    if isinstance(syntax_node, ast.Name):
        if syntax_node.id not in names:
            raise _error_at(syntax_node, f"{syntax_node.id[:40]!r} is no name here", f"use {', '.join(sorted(names))}")
        return ExpressionNode("name", (syntax_node.id,))
    if isinstance(syntax_node, ast.UnaryOp) and isinstance(syntax_node.op, (ast.USub, ast.UAdd)):
        inner = _read_node(syntax_node.operand, names, levels_left - 1, errors)
        return ExpressionNode("negative", (inner,)) if isinstance(syntax_node.op, ast.USub) else inner
    if isinstance(syntax_node, ast.BinOp) and isinstance(syntax_node.op, ast.Pow):
        base = _read_node(syntax_node.left, names, levels_left - 1, errors)
        return ExpressionNode("power", (base, _read_exponent(syntax_node.right)))
    if isinstance(syntax_node, ast.BinOp) and type(syntax_node.op) in OPERATORS:
        operands = tuple(
            _read_node(side, names, levels_left - 1, errors) for side in (syntax_node.left, syntax_node.right)
        )
        return ExpressionNode(OPERATORS[type(syntax_node.op)], operands)
    if isinstance(syntax_node, ast.Call) and isinstance(syntax_node.func, ast.Name):
        operands = tuple(_read_node(argument, names, levels_left - 1, errors) for argument in syntax_node.args)
        if syntax_node.func.id in FUNCTIONS:
            if len(syntax_node.args) != 1 or syntax_node.keywords:
                raise _error_at(
                    syntax_node, f"{syntax_node.func.id} takes one number", f"write {syntax_node.func.id}(...)"
                )
            return ExpressionNode(syntax_node.func.id, operands)
    raise _error_at(
        syntax_node, "is neither arithmetic nor a known function", f"use + - * / ** and {', '.join(FUNCTIONS)}"
    )


def _read_number(syntax_node: ast.Constant) -> float:
    if isinstance(syntax_node.value, bool) or not isinstance(syntax_node.value, (int, float)):
        raise _error_at(syntax_node, "is no number", "write a number such as 2.5 or 1e-3")
    try:
        number = float(syntax_node.value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise _error_at(syntax_node, "is too large a number", "write one below 1e308")
    return number


def _read_exponent(syntax_node: ast.AST) -> int:
    negative = isinstance(syntax_node, ast.UnaryOp) and isinstance(syntax_node.op, ast.USub)
    unsigned_node = syntax_node.operand if isinstance(syntax_node, ast.UnaryOp) and negative else syntax_node
    whole = unsigned_node.value if isinstance(unsigned_node, ast.Constant) else None
    if isinstance(whole, bool) or not isinstance(whole, int) or whole > MAX_EXPONENT:
        hint = f"write a whole number from -{MAX_EXPONENT} to {MAX_EXPONENT}, or use sqrt, exp and log"
        raise _error_at(syntax_node, "is no small whole power", hint)
    return -whole if negative else whole


def _error_at(syntax_node: ast.AST, problem: str, hint: str) -> ExpressionError:
    return ExpressionError(getattr(syntax_node, "col_offset", 0) + 1, problem, hint)
