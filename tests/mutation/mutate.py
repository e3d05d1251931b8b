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
    found: dict[str, Mutant] = {}
    for place in _places(tree, "module", None):
        for replacement in list(_replacements(place.node)):
            before = _header(place.statement)
            place.put(replacement)
            after = _header(replacement if place.statement is place.node else place.statement)
            name = f"{place.where}: {before} -> {after}"
            if before != after and name not in found:
                found[name] = Mutant(name, ast.unparse(tree))
            place.put(place.node)
    return list(found.values())


@dataclass(frozen=True)
class _Place:
    """Where a node stands: the function it is in, its statement, and its parent's field or place in a list of it."""

    where: str
    statement: ast.stmt
    node: ast.AST
    parent: ast.AST
    field: str
    index: int | None

    def put(self, other: ast.AST) -> None:
        """Let `other` stand there."""
        if self.index is None:
            setattr(self.parent, self.field, other)
        else:
            getattr(self.parent, self.field)[self.index] = other


def _places(parent: ast.AST, where: str, statement: ast.stmt | None) -> Iterator[_Place]:
    """Those of all nodes but texts, annotations and decorators."""
    for field, value in ast.iter_fields(parent):
        if field in ("annotation", "returns", "decorator_list") or isinstance(parent, ast.JoinedStr):
            continue
        for index, node in enumerate(value) if isinstance(value, list) else [(None, value)]:
            if not isinstance(node, ast.AST):
                continue
            inside, own = where, statement
            if isinstance(node, ast.stmt):
                own = node
            if isinstance(node, ast.FunctionDef | ast.ClassDef):
                inside = node.name if where == "module" else f"{where}.{node.name}"
            if own is not None:
                yield _Place(inside, own, node, parent, field, index)
            yield from _places(node, inside, own)


def _header(statement: ast.AST) -> str:
    """A statement's first line."""
    return ast.unparse(statement).partition(":\n")[0].strip()


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
