"""Small changes to a program, one at a time: each is a mistake that some test should notice."""

import ast
import copy
from collections.abc import Iterator
from dataclasses import dataclass

_COMPARISONS = {
    ast.Lt: (ast.LtE, ast.GtE), ast.LtE: (ast.Lt, ast.Gt), ast.Gt: (ast.GtE, ast.LtE), ast.GtE: (ast.Gt, ast.Lt),
    ast.Eq: (ast.NotEq,), ast.NotEq: (ast.Eq,), ast.Is: (ast.IsNot,), ast.IsNot: (ast.Is,),
    ast.In: (ast.NotIn,), ast.NotIn: (ast.In,),
}  # fmt: skip
_OPERATORS = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.Pow: ast.Mult,
    ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd, ast.BitXor: ast.BitOr, ast.LShift: ast.RShift, ast.RShift: ast.LShift,
    ast.FloorDiv: ast.Mult, ast.Mod: ast.FloorDiv,
}  # fmt: skip
_NAMES = {"min": "max", "max": "min"}


@dataclass(frozen=True)
class Mutant:
    """One change; `name` says where and what, whatever the line numbers are."""

    name: str
    source: str


def mutants_of(source: str) -> list[Mutant]:
    """Every mutant of a module: another operator, number, condition or name, or a statement less.

    Texts, annotations and decorators stay as they are.
    """
    tree = ast.parse(source)
    before = list(_headers(tree))
    found: dict[str, Mutant] = {}
    for place, node in enumerate(_changeable(tree)):
        for number in range(len(list(_replacements(node)))):
            changed = copy.deepcopy(tree)
            old = list(_changeable(changed))[place]
            _replace(changed, old, list(_replacements(old))[number])
            after = list(_headers(changed))
            pairs = [f"{was} -> {now}" for (where, was), (_, now) in zip(before, after, strict=True) if was != now]
            where = next(where for (where, was), (_, now) in zip(before, after, strict=True) if was != now)
            name = f"{where}: {pairs[0]}"
            found.setdefault(name, Mutant(name, ast.unparse(ast.fix_missing_locations(changed))))
    return list(found.values())


def _changeable(tree: ast.AST) -> Iterator[ast.AST]:
    """All nodes but those of texts, annotations and decorators."""
    for name, value in ast.iter_fields(tree):
        if name in ("annotation", "returns", "decorator_list") or isinstance(tree, ast.JoinedStr):
            continue
        for node in value if isinstance(value, list) else [value]:
            if isinstance(node, ast.AST):
                yield node
                yield from _changeable(node)


def _replacements(node: ast.AST) -> Iterator[ast.AST]:
    """What may stand in the place of a node."""
    if isinstance(node, ast.Compare):
        for place, old in enumerate(node.ops):
            for other in _COMPARISONS.get(type(old), ()):
                yield ast.Compare(node.left, [*node.ops[:place], other(), *node.ops[place + 1 :]], node.comparators)
    elif isinstance(node, ast.If | ast.IfExp) and not _is_for_type_checkers(node):
        for value in (True, False):
            changed = copy.copy(node)
            changed.test = ast.Constant(value)
            yield changed
    elif isinstance(node, ast.BinOp) and type(node.op) in _OPERATORS:
        yield ast.BinOp(node.left, _OPERATORS[type(node.op)](), node.right)
    elif isinstance(node, ast.AugAssign):
        yield ast.AugAssign(node.target, _OPERATORS[type(node.op)](), node.value)
        yield ast.Pass()
    elif isinstance(node, ast.BoolOp):
        yield ast.BoolOp(ast.Or() if isinstance(node.op, ast.And) else ast.And(), node.values)
    elif isinstance(node, ast.UnaryOp):
        yield node.operand
    elif isinstance(node, ast.Constant) and isinstance(node.value, bool):
        yield ast.Constant(not node.value)
    elif isinstance(node, ast.Constant) and isinstance(node.value, int | float):
        yield ast.Constant(2 * node.value + 1)
    elif isinstance(node, ast.Name) and node.id in _NAMES:
        yield ast.Name(_NAMES[node.id], node.ctx)
    elif _is_left_out_easily(node):
        yield ast.Pass()


def _is_for_type_checkers(node: ast.If | ast.IfExp) -> bool:
    return isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"


def _is_left_out_easily(node: ast.AST) -> bool:
    """A call for its effect, or a value kept in an attribute."""
    if isinstance(node, ast.Expr):
        return isinstance(node.value, ast.Call)
    return isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Attribute)


def _replace(tree: ast.AST, old: ast.AST, new: ast.AST) -> None:
    for parent in ast.walk(tree):
        for name, value in ast.iter_fields(parent):
            if value is old:
                setattr(parent, name, new)
            elif isinstance(value, list) and any(node is old for node in value):
                value[[node is old for node in value].index(True)] = new


def _headers(tree: ast.AST, where: str = "module") -> Iterator[tuple[str, str]]:
    """Each statement's function and first line, in order."""
    for node in ast.iter_child_nodes(tree):
        inside = where
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            inside = node.name if where == "module" else f"{where}.{node.name}"
        if isinstance(node, ast.stmt):
            yield inside, ast.unparse(node).partition(":\n")[0].strip()
        yield from _headers(node, inside)
