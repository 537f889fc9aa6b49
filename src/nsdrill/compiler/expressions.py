"""Expressions of the lane language, as instructions."""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, NamedTuple, TypeGuard

import numpy as np

from nsdrill.compiler.ir import Text, Value
from nsdrill.compiler.language import (
    KINDS,
    RUNTIME,
    Array,
    Bits,
    Fixed,
    FunctionArgument,
    Lane,
    Masks,
    Refusal,
    Scope,
    Slot,
    Unassigned,
    constant_of,
    hold,
    is_number,
    plain,
    targets,
)


class Operation(NamedTuple):
    """An operation on two operands: on constants, as instructions by the kind of values
    (none where there is none), and what to write in its place."""

    plain: Callable[[Any, Any], Any]
    instructions: Mapping[str, str] = {}
    instead: str = ""


OPERATIONS: dict[type, Operation] = {
    ast.Add: Operation(operator.add, {"d": "fadd", "i": "add"}),
    ast.Sub: Operation(operator.sub, {"d": "fsub", "i": "sub"}),
    ast.Mult: Operation(operator.mul, {"d": "fmul", "i": "mul"}),
    ast.Div: Operation(operator.truediv, {"d": "fdiv"}, "a division of floats: float(a) / float(b)"),
    ast.FloorDiv: Operation(operator.floordiv, {"i": "sdiv"}, "of integers; of floats np.floor(a / b)"),
    ast.Mod: Operation(operator.mod, {"i": "srem"}, "of integers; of floats np.fmod"),
    ast.Pow: Operation(operator.pow),
    ast.MatMult: Operation(operator.matmul),
    ast.BitAnd: Operation(operator.and_, {"i": "and", "b": "and"}),
    ast.BitOr: Operation(operator.or_, {"i": "or", "b": "or"}),
    ast.BitXor: Operation(operator.xor, {"i": "xor", "b": "xor"}),
    ast.LShift: Operation(operator.lshift, {"i": "shl"}),
    ast.RShift: Operation(operator.rshift, {"i": "ashr"}),
    ast.Lt: Operation(operator.lt, {"d": "olt", "i": "slt"}),
    ast.LtE: Operation(operator.le, {"d": "ole", "i": "sle"}),
    ast.Gt: Operation(operator.gt, {"d": "ogt", "i": "sgt"}),
    ast.GtE: Operation(operator.ge, {"d": "oge", "i": "sge"}),
    ast.Eq: Operation(operator.eq, {"d": "oeq", "i": "eq", "b": "eq"}),
    ast.NotEq: Operation(operator.ne, {"d": "une", "i": "ne", "b": "ne"}),
    ast.Is: Operation(operator.is_),
    ast.IsNot: Operation(operator.is_not),
    ast.In: Operation(lambda a, b: a in b),
    ast.NotIn: Operation(lambda a, b: a not in b),
}
CONSTANT_SIGNS: dict[type, Callable[[Any], Any]] = {
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
    ast.Invert: operator.invert,
}
SUM = "a loop, or the terms written out"
INSTEAD_OF_EXPRESSIONS: dict[type, str] = {
    **dict.fromkeys((ast.ListComp, ast.GeneratorExp, ast.SetComp, ast.DictComp), SUM),
    ast.Lambda: "a function with a name",
    ast.NamedExpr: "an assignment before it",
}
EXPRESSIONS = "numbers, names, arithmetic, comparisons, a if c else b, tuples, elements of buffers and calls"


class Expressions:
    """Gives for each expression a constant, a value or one of
    :data:`nsdrill.compiler.language.RUNTIME`."""

    unrolled = 8  # turns of a loop that are written out, at most
    text: Text
    lane_count: int  # of the vector that is being written; 0 outside loops over lanes

    # Kinds and lanes.
    def value(self, v: object, kind: str = "", *, wide: bool = True) -> Value:
        """``v`` as a Value, of this kind if one is asked for; in every lane of the
        vector that is being written unless ``wide`` is False and it is a scalar."""
        if isinstance(v, Lane):
            places = self.text.integers([v.offset + k for k in range(self.lane_count)])
            v = (
                places
                if v.base is None
                else self.text.operation("add", self.text.widened(v.base, self.lane_count), places)
            )
        elif isinstance(v, Bits):
            weights = (
                self.text.constant(v.weight, "i", v.mask.lanes)
                if v.weight is not None
                else self.text.integers([1 << (v.shift + k) for k in range(v.mask.lanes)])
            )
            v = self.text.selection(v.mask, weights, self.text.constant(0, "i", v.mask.lanes))
        if isinstance(v, Value):
            if kind and v.kind != kind:
                raise Refusal(
                    f"{KINDS[v.kind]} stands where {KINDS[kind]} is needed; allowed: "
                    f"{ {'d': 'float(x)', 'i': 'int(x)', 'b': 'a comparison, such as x != 0'}[kind] }"
                )
            return self.text.widened(v, self.lane_count) if wide and self.lane_count and not v.lanes else v
        v = plain(v)
        if not is_number(v):
            raise Refusal(f"{described(v)} stands where a number is needed")
        if kind != "d" and isinstance(v, int) and not -(1 << 63) <= v < 1 << 63:
            raise Refusal(f"{v} has more than 64 bits")
        own = "b" if isinstance(v, bool) else "i" if isinstance(v, int) else "d"
        if kind and own != kind and not (own == "i" and kind == "d" and float(v) == v):
            raise Refusal(f"{KINDS[own]}, {v!r}, stands where {KINDS[kind]} is needed")
        return self.text.constant(v, kind or own, self.lane_count if wide else 0)

    def pair(self, a: object, b: object) -> tuple[Value, Value]:
        """Two operands of one kind, both scalars or both vectors."""
        a, b = (self.value(v, wide=False) if isinstance(v, (Lane, Bits)) else v for v in (a, b))
        values = [v for v in (a, b) if isinstance(v, Value)]
        kind = values[0].kind if values else ""
        if values and values[-1].kind != kind:
            raise Refusal(
                f"{KINDS[kind]} and {KINDS[values[-1].kind]} meet in one operation; allowed: two of a kind, as "
                "by float(n), int(x) or a comparison"
            )
        wide = any(v.lanes for v in values)
        return self.value(a, kind, wide=wide), self.value(b, kind, wide=wide)

    def truth(self, v: object) -> bool | Value:
        """``v`` as a condition: a constant truth, or a value of that kind."""
        if not isinstance(v, RUNTIME):
            return bool(v)
        return self.value(v, "b", wide=False)

    # Names.
    def lookup(self, name: str, scope: Scope) -> object:
        holder = scope.holder(name)
        if holder is None:
            return plain(constant_of(scope.function, name))
        if holder is not scope:
            scope.read.add(name)
            check_not_carried(name, scope)
        found = holder.names[name]
        if isinstance(found, Slot):
            if found.reason:
                raise Refusal(found.reason)
            if found.pointer is None:
                raise Refusal(f"{name} has no value here; allowed: a name that is assigned on every way here")
            return self.text.load(found.pointer, found.kind, found.lanes)
        if isinstance(found, Unassigned):
            raise Refusal(found.reason)
        return found.value if isinstance(found, Fixed) else found

    # Expressions.
    def eval(self, node: ast.expr, scope: Scope) -> object:
        method: Callable[[ast.expr, Scope], object] | None = getattr(self, f"eval_{type(node).__name__}", None)
        if method is None:
            raise Refusal(
                f"{ast.unparse(node)} is no expression of the language of compiled functions; "
                f"allowed: {INSTEAD_OF_EXPRESSIONS.get(type(node), EXPRESSIONS)}"
            )
        return method(node, scope)

    def eval_Constant(self, node: ast.Constant, scope: Scope) -> object:
        return node.value

    def eval_Name(self, node: ast.Name, scope: Scope) -> object:
        return self.lookup(node.id, scope)

    def eval_Tuple(self, node: ast.Tuple | ast.List, scope: Scope) -> tuple[object, ...]:
        return self.parts(node.elts, scope)

    eval_List = eval_Tuple

    def parts(self, nodes: list[ast.expr], scope: Scope) -> tuple[object, ...]:
        """The values of expressions side by side; those with a star are tuples, whose
        parts are among them."""
        found: list[object] = []
        for node in nodes:
            if isinstance(node, ast.Starred):
                value = self.eval(node.value, scope)
                if not isinstance(value, (tuple, list)):
                    raise Refusal(f"{ast.unparse(node)} is of a tuple")
                found += value
            else:
                found.append(self.eval(node, scope))
        return tuple(found)

    def each(self, node: ast.GeneratorExp, scope: Scope) -> tuple[object, ...]:
        """The expression ``node`` for each item of a tuple, which is written out."""
        (head, *more) = node.generators
        if more or head.ifs:
            raise Refusal("a tuple is of one loop, without a condition")
        items: Any = self.eval(head.iter, scope)
        if isinstance(items, RUNTIME) or not hasattr(items, "__iter__"):
            raise Refusal("a tuple is made of the items of a tuple, or of a range that is known")
        before, found = dict(scope.names), []
        for item in items:
            hold(head.target, plain(item), scope)
            found.append(self.eval(node.elt, scope))
        for name in targets(head.target):
            scope.names.pop(name, None)  # of no item it was never there
            if name in before:
                scope.names[name] = before[name]
        return tuple(found)

    def eval_Attribute(self, node: ast.Attribute, scope: Scope) -> object:
        owner = self.eval(node.value, scope)
        if isinstance(owner, RUNTIME) or not hasattr(owner, node.attr):
            raise Refusal(f"{ast.unparse(node)} is not defined")
        return plain(getattr(owner, node.attr))

    def eval_BinOp(self, node: ast.BinOp, scope: Scope) -> object:
        a, b = self.eval(node.left, scope), self.eval(node.right, scope)
        return self.binary(type(node.op), a, b, (node.left, node.right))

    def binary(self, op: type, a: object, b: object, nodes: tuple[ast.expr, ...] = ()) -> object:
        """The operation on ``a`` and ``b``, which come from ``nodes``."""
        if not isinstance(a, RUNTIME) and not isinstance(b, RUNTIME):
            return plain(OPERATIONS[op].plain(a, b))
        found = self._with_lane(op, a, b)
        if found is not None:
            return found
        _, instructions, instead = OPERATIONS[op]
        if "b" not in instructions:
            for truth, node, other in zip((a, b), nodes, (b, a), strict=False):
                _check_no_truth(truth, node, other)
        one, two = self.pair(a, b)
        instruction = instructions.get(one.kind)
        if instruction is None:
            instead = _instead_of_power(b) if op is ast.Pow else instead
            allowed = f"; allowed: {instead}" if instead else ""
            raise Refusal(f"this operation is not defined for {KINDS[one.kind]}{allowed}")
        if op in (ast.Mod, ast.FloorDiv):  # a division by zero would end the process
            zero = self.text.comparison("eq", two, self.text.constant(0, "i", two.lanes))
            two = self.text.selection(zero, self.text.constant(1, "i", two.lanes), two)
        made = self.text.operation(instruction, one, two)
        return self._floored(op, made, one, two) if op in (ast.Mod, ast.FloorDiv) else made

    def _with_lane(self, op: type, a: object, b: object) -> Lane | Bits | None:
        """The index of the lane plus or minus a scalar, or a bit at its place; None where
        it is neither."""
        if isinstance(b, Lane) and op is ast.Add and not isinstance(a, Lane):
            a, b = b, a
        if isinstance(b, Lane):
            if op is ast.LShift and a == 1 and b.base is None:
                return Bits(self.text.constant(True, "b", self.lane_count), None, b.offset)
            return None
        if not isinstance(a, Lane):
            return None
        if op in (ast.Add, ast.Sub) and isinstance(b, int) and not isinstance(b, bool):
            return Lane(a.offset + b if op is ast.Add else a.offset - b, a.base)
        if op is ast.Add and isinstance(b, Value) and b.kind == "i" and not b.lanes:
            return Lane(a.offset, b if a.base is None else self.text.operation("add", a.base, b))
        return None

    def _floored(self, op: type, made: Value, a: Value, b: Value) -> Value:
        """Quotient or remainder rounded as in Python, where the instruction rounds
        towards zero."""
        zero = self.text.constant(0, "i", a.lanes)
        rest = made if op is ast.Mod else self.text.operation("srem", a, b)
        opposite = self.text.comparison("slt", self.text.operation("xor", rest, b), zero)
        off = self.text.operation("and", opposite, self.text.comparison("ne", rest, zero))
        corrected = (
            self.text.operation("add", made, b)
            if op is ast.Mod
            else self.text.operation("sub", made, self.text.constant(1, "i", a.lanes))
        )
        return self.text.selection(off, corrected, made)

    def eval_UnaryOp(self, node: ast.UnaryOp, scope: Scope) -> object:
        a = self.eval(node.operand, scope)
        if isinstance(node.op, ast.Not):
            truth = self.truth(a)
            return self.negation(truth) if isinstance(truth, Value) else not truth
        if not isinstance(a, RUNTIME):
            return CONSTANT_SIGNS[type(node.op)](a)
        a = self.value(a, wide=False)
        if isinstance(node.op, ast.USub) and a.kind == "d":
            return self.text.operation("fneg", a)
        if a.kind != "i" or not isinstance(node.op, ast.USub):
            raise Refusal(f"this operation is not defined for {KINDS[a.kind]}")
        return self.text.operation("sub", self.text.constant(0, "i", a.lanes), a)

    def negation(self, truth: Value) -> Value:
        return self.text.operation("xor", truth, self.text.constant(True, "b", truth.lanes))

    def eval_BoolOp(self, node: ast.BoolOp, scope: Scope) -> object:
        """``and`` and ``or``: what follows is evaluated only where it decides, if it
        reads memory or calls something and the operands are scalars."""
        is_and = isinstance(node.op, ast.And)
        result: Value | None = None
        for number, part in enumerate(node.values):
            if result is not None and not result.lanes and not self.lane_count and _acts(part):
                rest = ast.BoolOp(node.op, node.values[number:]) if node.values[number + 1 :] else part
                return self._short_circuit(is_and, result, rest, scope)
            truth = self.truth(self.eval(part, scope))
            if isinstance(truth, bool):
                if truth != is_and:
                    return truth
            elif result is None:
                result = truth
            else:
                result = self.text.operation("and" if is_and else "or", *self.pair(result, truth))
        return is_and if result is None else result

    def both(self, a: bool | Value, b: bool | Value) -> bool | Value:
        """Whether two truths hold."""
        if isinstance(a, bool):
            return b if a else a
        if isinstance(b, bool):
            return a if b else b
        return self.text.operation("and", *self.pair(a, b))

    def _short_circuit(self, is_and: bool, first: Value, rest: ast.expr, scope: Scope) -> Value:
        slot, more, done = self.text.slot("b"), self.text.block("more"), self.text.block("done")
        self.text.store(first, slot)
        self.text.branch_if(first, *((more, done) if is_and else (done, more)))
        self.text.begin(more)
        self.text.store(self.value(self.truth(self.eval(rest, scope)), "b"), slot)
        self.text.branch(done)
        self.text.begin(done)
        return self.text.load(slot, "b")

    def eval_Compare(self, node: ast.Compare, scope: Scope) -> object:
        left = self.eval(node.left, scope)
        result: bool | Value = True
        for op, right_node in zip(node.ops, node.comparators, strict=True):
            right = self.eval(right_node, scope)
            result = self.both(result, self.compare(type(op), left, right))
            left = right
        return result

    def compare(self, op: type, a: object, b: object) -> bool | Value:
        if not isinstance(a, RUNTIME) and not isinstance(b, RUNTIME):
            return bool(OPERATIONS[op].plain(a, b))
        one, two = self.pair(a, b)
        name = OPERATIONS[op].instructions.get(one.kind)
        if name is None:
            raise Refusal(f"this comparison is not defined for {KINDS[one.kind]}")
        return self.text.comparison(name, one, two)

    def eval_IfExp(self, node: ast.IfExp, scope: Scope) -> object:
        test = self.truth(self.eval(node.test, scope))
        if isinstance(test, bool):
            return self.eval(node.body if test else node.orelse, scope)
        if not self.lane_count and (_acts(node.body) or _acts(node.orelse)):
            return self._one_of(test, node, scope)
        return self.select(test, self.eval(node.body, scope), self.eval(node.orelse, scope))

    def _one_of(self, test: Value, node: ast.IfExp, scope: Scope) -> object:
        """The side of a condition that holds; the other is not evaluated."""
        text = self.text
        then, other, done = (text.block(label) for label in ("then", "else", "done"))
        text.branch_if(test, then, other)
        sides, ends = [], []
        for label, side in ((then, node.body), (other, node.orelse)):
            text.begin(label)
            sides.append(self.eval(side, scope))
            ends.append(text.at)
            text.branch(done)
        text.begin(done)
        first, second = sides
        return self._joined(first, second, lambda a, b: text.merged(a, ends[0], b, ends[1]))

    def _joined(self, a: object, b: object, join: Callable[[Value, Value], Value]) -> object:
        """The two sides of a condition, or the parts of two tuples."""
        if isinstance(a, tuple) and isinstance(b, tuple) and len(a) == len(b):
            return tuple(self._joined(x, y, join) for x, y in zip(a, b, strict=True))
        if isinstance(a, tuple) and isinstance(b, tuple):
            raise Refusal("the two sides of a condition have different numbers of values")
        if not isinstance(a, RUNTIME) and not isinstance(b, RUNTIME) and type(a) is not type(b):
            a, b = (float(v) if _is_integer(v) else v for v in (a, b))
        return join(*self.pair(a, b))

    def select(self, mask: Value, a: object, b: object) -> object:
        if isinstance(a, Bits) and not mask.lanes:
            mask = self.text.widened(mask, a.mask.lanes)
        if mask.lanes:
            if isinstance(a, Bits) and _is_zero(b):
                return replace(a, mask=self.text.operation("and", *self.pair(mask, a.mask)))
            if _is_integer(a) and _is_zero(b):
                return Bits(mask, a)
            if _is_integer(b) and _is_zero(a):
                return Bits(self.negation(mask), b)
        return self._joined(a, b, lambda one, two: self._selected(mask, one, two))

    def _selected(self, mask: Value, one: Value, two: Value) -> Value:
        if mask.lanes and not one.lanes:
            one, two = (self.text.widened(v, mask.lanes) for v in (one, two))
        elif one.lanes and not mask.lanes:
            mask = self.text.widened(mask, one.lanes)
        return self.text.selection(mask, one, two)

    # Memory.
    def eval_Subscript(self, node: ast.Subscript, scope: Scope) -> object:
        array = self.eval(node.value, scope)
        if isinstance(node.slice, ast.Slice):
            return self._slice(array, node.slice, scope)
        return self.element(array, self.eval(node.slice, scope))

    def _slice(self, array: object, part: ast.Slice, scope: Scope) -> object:
        lower, upper = (None if at is None else self.eval(at, scope) for at in (part.lower, part.upper))
        if part.step is not None or lower is None or not isinstance(array, Array):
            raise Refusal("a part is of a buffer, has a first place and no step; allowed: b[first:] or b[first:stop]")
        for end in (lower, upper):
            if isinstance(end, int) and end < 0:
                raise Refusal(BEFORE)
        first = self.value(lower, "i", wide=False)
        stop = array.length if upper is None else self.value(upper, "i", wide=False)
        length = self.text.operation("sub", stop, first)
        return Array(self.text.address(array.ref, first, array.kind), length, array.kind)

    def element(self, array: Any, index: object) -> object:
        if isinstance(array, Masks) and self.lane_count:
            raise Refusal(
                "a set of lanes is read in a loop over lanes; allowed: after it, or a name that has it before"
            )
        if isinstance(array, Array):
            pointer, count = self.place(array, index)
            return self.text.load(pointer, array.kind, count)
        if isinstance(array, RUNTIME):
            raise Refusal("only buffers, tuples and tables have elements")
        parts = index if isinstance(index, tuple) else (index,)
        if not any(isinstance(part, RUNTIME) for part in parts):
            return plain(array[index])
        table = np.asarray(array) if not any(isinstance(x, (RUNTIME, tuple)) for x in array) else None
        if table is None or table.dtype.kind not in "fib" or table.ndim != len(parts):
            raise Refusal(
                "a tuple of values is indexed by a number that is not known; allowed: a loop of at most "
                f"{self.unrolled} turns, or a table of numbers"
            )
        flat: object = 0
        for part, size in zip(parts, table.shape, strict=True):
            flat = self.binary(ast.Add, self.binary(ast.Mult, flat, size), part)
        where = self.value(flat, "i", wide=False)
        if where.lanes:
            raise Refusal("a table is indexed by another number in every lane; allowed: a scalar")
        found = self.text.table(table.ravel().tolist(), "d" if table.dtype.kind == "f" else "i", where)
        if table.dtype.kind == "b":
            return self.text.comparison("ne", found, self.text.constant(0, "i"))
        return found

    def place(self, array: Array, index: object) -> tuple[str, int]:
        """The address of an element or, with the index of the lane, of a row: (pointer,
        lanes)."""
        first = index if isinstance(index, int) else 0
        if isinstance(index, Lane) and index.base is None:
            first = index.offset
        if first < 0:
            raise Refusal(BEFORE)
        if isinstance(index, Lane):
            where = self.text.constant(index.offset, "i")
            if index.base is not None:
                where = self.text.operation("add", index.base, where)
            return self.text.address(array.ref, where, array.kind), self.lane_count
        where = self.value(index, "i", wide=False)
        if where.lanes:
            raise Refusal(
                "a buffer is indexed by another place in every lane; allowed: b[row + i], or a loop over range(W)"
            )
        return self.text.address(array.ref, where, array.kind), 0


BEFORE = "a place before the beginning of a buffer; allowed: b[len(b) - 1]"


def _acts(node: ast.expr) -> bool:
    return any(isinstance(part, (ast.Call, ast.Subscript)) for part in ast.walk(node))


def _is_integer(v: object) -> TypeGuard[int]:
    return isinstance(v, int) and not isinstance(v, bool)


def _is_zero(v: object) -> bool:
    return _is_integer(v) and v == 0


def _check_no_truth(v: object, node: ast.expr, other: object) -> None:
    """Refuse a truth, written as ``node``, in arithmetic with the number ``other``."""
    kind = other.kind if isinstance(other, Value) else "i" if _is_integer(other) else "d"
    if isinstance(v, Value) and v.kind == "b" != kind and (isinstance(other, Value) or is_number(other)):
        number = "int" if kind == "i" else "float"
        raise Refusal(f"{KINDS[kind]} and a truth meet in one operation; allowed: {number}({ast.unparse(node)})")


def _instead_of_power(exponent: Any) -> str:
    if not isinstance(exponent, RUNTIME) and float(exponent).is_integer():
        return "a product"
    return "np.sqrt and products, or exp2(p * log2(x)) with exp2 and log2 of nsdrill.elementary"


def check_not_carried(name: str, scope: Scope) -> None:
    if name in scope.summed or (name in scope.read and name in scope.names):
        raise Refusal(
            f"{name} carries a value from lane to lane; allowed: a row of the buffer, or a set of lanes, "
            "s |= (1 << i) if c else 0, that is read after the loop"
        )


def described(v: object) -> str:
    if isinstance(v, RUNTIME):
        return {Array: "a buffer", Masks: "sets of lanes", FunctionArgument: "a function"}.get(type(v), "a value")
    if isinstance(v, tuple):
        return "a tuple"
    return getattr(v, "__name__", None) or repr(v)
