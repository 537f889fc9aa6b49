"""Statements of the lane language, as instructions: the body of one function."""

from __future__ import annotations

import ast
from collections.abc import Iterable
from types import FunctionType
from typing import Any

from nsdrill.compiler.calls import JUMPED, Callees, Calls, Returned
from nsdrill.compiler.expressions import check_not_carried
from nsdrill.compiler.ir import Text, Value
from nsdrill.compiler.language import (
    RUNTIME,
    Array,
    Bits,
    Fixed,
    FunctionArgument,
    Lane,
    LanguageError,
    Masks,
    Refusal,
    Scope,
    Slot,
    Unassigned,
    assigned,
    carried,
    constant_of,
    hold,
    is_number,
    is_over_lanes,
    leaves_loop,
    plain,
    targets,
)
from nsdrill.compiler.vocabulary import packed


class Body(Calls):
    """Writes one function of a module and all that is inlined into it. ``width`` is the
    greatest number of lanes in a vector."""

    def __init__(self, module: Callees, text: Text, width: int) -> None:
        super().__init__(module, text)
        self.width = width

    # Functions.
    def write(self, function: FunctionType, arguments: list[object]) -> None:
        """The whole body of ``function``, which returns an integer."""
        self.outermost = function
        if self.entered(function, arguments, {}) is not JUMPED:
            self.text.line("ret i64 0")

    # Statements. None where the next one follows, or how the body ended.
    def run(self, body: list[ast.stmt], scope: Scope) -> Returned | None:
        for statement in body:
            method = getattr(self, f"do_{type(statement).__name__}", None)
            try:
                if method is None:
                    raise Refusal(
                        "this statement is not in the language of compiled functions; allowed: "
                        "assignments, calls, if, for, while, break, continue, pass, assert and return"
                    )
                result = method(statement, scope)
            except Refusal as refusal:
                raise _placed(refusal, statement, scope) from None
            except (TypeError, ValueError, IndexError, AttributeError, KeyError, ZeroDivisionError) as error:
                raise _placed(error, statement, scope) from error
            if result is not None:
                return result
        return None

    def do_Expr(self, node: ast.Expr, scope: Scope) -> None:
        if not isinstance(node.value, ast.Constant):
            self.eval(node.value, scope)

    def do_Pass(self, node: ast.Pass, scope: Scope) -> None:
        pass

    def do_Assert(self, node: ast.Assert, scope: Scope) -> None:
        test = self.truth(self.eval(node.test, scope))
        if not isinstance(test, bool):
            raise Refusal("what is asserted is not known before it runs; allowed: an if")
        if not test:
            raise Refusal(str(self.eval(node.msg, scope)) if node.msg else "this does not hold")

    def do_Return(self, node: ast.Return, scope: Scope) -> Returned:
        value = None if node.value is None else self.eval(node.value, scope)
        if self.outermost is None:
            return Returned(value)
        if self.lane_count:
            raise Refusal("a return in a loop over lanes")
        self.text.line(f"ret i64 {'0' if value is None else self.value(value, 'i').ref}")
        return JUMPED

    def do_Assign(self, node: ast.Assign, scope: Scope) -> None:
        value = self.eval(node.value, scope)
        for target in node.targets:
            self._bind(target, value, scope)

    def _bind(self, target: ast.expr, value: object, scope: Scope) -> None:
        if isinstance(target, ast.Name):
            self._assign(target.id, value, scope, bool(self.lane_count))
        elif isinstance(target, ast.Tuple):
            if not isinstance(value, tuple) or len(value) != len(target.elts):
                raise Refusal(f"one value, or another number of values, for {len(target.elts)} names")
            for part, single in zip(target.elts, value, strict=True):
                self._bind(part, single, scope)
        elif isinstance(target, ast.Subscript):
            self._set(self.eval(target.value, scope), self.eval(target.slice, scope), value)
        else:
            raise Refusal(f"{ast.unparse(target)} cannot be assigned to")

    def _assign(self, name: str, value: object, scope: Scope, wide: bool) -> None:
        """Assign to a name of ``scope``; ``wide`` if it has a value in every lane."""
        found = scope.names.get(name)
        if isinstance(found, Fixed):
            raise Refusal(f"{name} is not a number and changes in a branch or loop; allowed: numbers, each with a name")
        if not isinstance(found, Slot):
            scope.names[name] = value
            check_not_carried(name, scope)
            return
        is_single = isinstance(value, RUNTIME) or is_number(value)
        if not is_single or isinstance(value, (Array, FunctionArgument)):
            if found.pointer is not None:
                raise Refusal(f"{name} is a number and becomes something else")
            scope.names[name] = Fixed(value)  # until the end of the branch
            return
        if found.pointer is None:
            made = self.value(value, wide=wide)
            found.kind, found.lanes = made.kind, made.lanes
            found.pointer = self.text.slot(made.kind, made.lanes)
        else:
            made = self.value(value, found.kind, wide=bool(found.lanes))
        found.reason = ""
        if made.lanes != found.lanes:
            raise Refusal(f"{name} is a number for all lanes and another for each of them")
        self.text.store(made, found.pointer)

    def _set(self, array: object, index: object, value: object) -> None:
        if not isinstance(array, Array):
            raise Refusal("only elements of buffers can be assigned to")
        pointer, count = self.place(array, index)
        if self.lane_count and not count:
            raise Refusal("one element is assigned in every lane; allowed: b[row + i]")
        made = self.value(value, array.kind, wide=bool(count))
        if made.lanes != count:
            raise Refusal("a value for each lane is assigned to one element; allowed: b[row + i]")
        self.text.store(made, pointer)

    def do_AugAssign(self, node: ast.AugAssign, scope: Scope) -> None:
        op, target = type(node.op), node.target
        if isinstance(target, ast.Subscript):
            array, index = self.eval(target.value, scope), self.eval(target.slice, scope)
            if isinstance(array, Masks) and self.lane_count:
                self._unite(array, index, op, self.eval(node.value, scope))
                return
            old = self.element(array, index)
            value = self.eval(node.value, scope)
            self._set(array, index, self.binary(op, old, value, (target, node.value)))
            return
        if not isinstance(target, ast.Name):
            raise Refusal(f"{ast.unparse(target)} cannot be assigned to")
        holder = scope.holder(target.id)
        if holder is None:
            constant_of(scope.function, target.id)
            raise Refusal(f"{target.id} is not a variable of this function")
        value = self.eval(node.value, scope)
        if holder is not scope:  # a set of lanes
            if op is not ast.BitOr:
                raise Refusal("lanes accumulate only sets: s |= (1 << i) if c else 0, or a row of the buffer")
            scope.summed.add(target.id)
            if target.id in scope.read:
                check_not_carried(target.id, scope)
            value = self._reduced(value)
        old = self.lookup(target.id, holder)
        result = self.binary(op, old, value, (target, node.value))
        self._assign(target.id, result, holder, bool(self.lane_count) and holder is scope)

    def _unite(self, array: Masks, index: object, op: type, value: object) -> None:
        """Add lanes to one of several sets."""
        pointer, lanes = self.place(array, index)
        if op is not ast.BitOr or lanes:
            raise Refusal("lanes accumulate only sets: s[k] |= (1 << i) if c else 0")
        old = self.text.load(pointer, array.kind)
        self.text.store(self.value(self.binary(op, old, self._reduced(value)), array.kind, wide=False), pointer)

    def _reduced(self, value: object) -> object:
        """The sum over the lanes of their bits, a scalar."""
        if not isinstance(value, Bits):
            if isinstance(value, RUNTIME) and not (isinstance(value, Value) and not value.lanes):
                raise Refusal("a set of lanes is (1 << i) if c else 0, or 1 if c else 0")
            return value
        bits = self.text.bits_of(value.mask)
        if value.weight is None:
            return self.binary(ast.LShift, bits, value.shift) if value.shift else bits
        some = self.text.comparison("ne", bits, self.text.constant(0, "i"))
        return self.text.selection(some, self.text.constant(value.weight, "i"), self.text.constant(0, "i"))

    # Branches.
    def open(self, names: Iterable[str], scope: Scope) -> dict[str, Slot]:
        """Give the names that a branch or loop assigns a place in memory. The result
        are those that have no value yet."""
        names = list(names)
        for name in names:
            holder = scope.holder(name) or scope
            found = holder.names.get(name)
            if isinstance(found, (Slot, Fixed)):
                continue
            if found is None or isinstance(found, Unassigned):
                holder.names[name] = Slot()
            elif isinstance(found, (Array, FunctionArgument)) or not (isinstance(found, RUNTIME) or is_number(found)):
                holder.names[name] = Fixed(found)
            else:
                holder.names[name] = Slot()
                self._assign(name, found, holder, bool(self.lane_count) and holder is scope)
        slots = {name: (scope.holder(name) or scope).names[name] for name in names}
        return {
            name: slot
            for name, slot in slots.items()
            if isinstance(slot, Slot) and (slot.pointer is None or slot.reason)
        }

    def do_If(self, node: ast.If, scope: Scope) -> Returned | None:
        test = self.truth(self.eval(node.test, scope))
        if isinstance(test, bool):
            return self.run(node.body if test else node.orelse, scope)
        if self.lane_count:
            raise Refusal("a branch in a loop over lanes; allowed: x = a if c else b, or a branch around the loop")
        text = self.text
        without = self.open(assigned([*node.body, *node.orelse]), scope)
        then, after = text.block("then"), text.block("after")
        other = text.block("else") if node.orelse else after
        text.branch_if(test, then, other)
        ended, unassigned = [], set()
        for label, body in ((then, node.body), (other, node.orelse)):
            _forget(without)
            if body:
                text.begin(label)
            ended.append(self._branch(body, scope))
            if not ended[-1]:
                unassigned |= {name for name, slot in without.items() if slot.reason}
                if body:
                    text.branch(after)
        _forget({name: without[name] for name in unassigned})
        text.begin(after)
        if all(ended):
            text.line("unreachable")
            return JUMPED
        return None

    def _branch(self, body: list[ast.stmt], scope: Scope) -> bool:
        """Write a branch or the turn of a loop; whether it ended by a jump. What it
        assigns and is no number is not known after it."""
        before = {name for name, found in scope.names.items() if isinstance(found, Fixed)}
        result = self.run(body, scope)
        for name, found in scope.names.items():
            if isinstance(found, Fixed) and name not in before:
                scope.names[name] = Slot()
        if result is not None and not result.jumped:
            raise _placed(
                Refusal("a return from the midst of an inlined function; allowed: one return, at its end"),
                body[-1], scope,
            )  # fmt: skip
        return result is not None

    def do_While(self, node: ast.While, scope: Scope) -> Returned | None:
        if self.lane_count:
            raise Refusal("a while loop in a loop over lanes; allowed: the other way round")
        text = self.text
        without = self.open(assigned(node.body), scope)
        _forget(without)
        head, body, after = text.block("head"), text.block("body"), text.block("after")
        text.branch(head)
        text.begin(head)
        test = self.truth(self.eval(node.test, scope))
        text.branch_if(self.value(test, "b"), body, after)
        text.begin(body)
        self._turn(node.body, scope, head, after)
        text.begin(after)
        if not isinstance(node.test, ast.Constant):
            _forget(without)
        return None

    def _turn(self, body: list[ast.stmt], scope: Scope, again: str, after: str) -> None:
        self.loops.append((again, after))
        if not self._branch(body, scope):
            self.text.branch(again)
        self.loops.pop()

    def do_Break(self, node: ast.Break, scope: Scope) -> Returned:
        return self._jump(1)

    def do_Continue(self, node: ast.Continue, scope: Scope) -> Returned:
        return self._jump(0)

    def _jump(self, which: int) -> Returned:
        labels = self.loops[-1] if self.loops else None
        if labels is None or self.lane_count:
            raise Refusal("break or continue of a loop that is written out, or over lanes")
        self.text.branch(labels[which])
        return JUMPED

    # Loops.
    def do_For(self, node: ast.For, scope: Scope) -> Returned | None:
        if node.orelse:
            raise Refusal("a loop with else")
        head = node.iter
        if isinstance(head, ast.Call) and not head.keywords:
            function = self.eval(head.func, scope)
            if function is packed or function is range:
                limits: list[Any] = [self.eval(argument, scope) for argument in head.args]
                known = not any(isinstance(limit, RUNTIME) for limit in limits)
                if function is packed:
                    if not known or self.lane_count or not is_over_lanes(node):
                        raise Refusal("packed(W) has a number that is known, in no other loop over lanes")
                    self._over_lanes(node, packed(*limits), scope)
                    return None
                return self._over_range(node, limits, known, scope)
        if is_over_lanes(node):
            raise Refusal("the arguments of packed have no names")
        items: Any = self.eval(head, scope)
        if isinstance(items, RUNTIME) or not hasattr(items, "__iter__"):
            raise Refusal("a loop is over packed(W), range(...) or a tuple")
        return self._written_out(node, items, scope)

    def _written_out(self, node: ast.For, items: Iterable[object], scope: Scope) -> Returned | None:
        if leaves_loop(node.body) and not self.lane_count:
            raise Refusal("break or continue of a loop over a tuple")
        before = {name: scope.names.get(name) for name in targets(node.target)}
        result = None
        self.loops.append(None)
        for item in items:
            hold(node.target, plain(item), scope)
            if (result := self.run(node.body, scope)) is not None:
                break
        self.loops.pop()
        _release(before, scope, "an index of a loop")
        return result

    def _over_lanes(self, node: ast.For, places: range, scope: Scope) -> None:
        if not isinstance(node.target, ast.Name):
            raise Refusal("a loop over lanes has one index")
        inner = Scope(scope.function, scope)
        at = places.start
        while at < places.stop:
            self.lane_count = min(self.width, 1 << ((places.stop - at).bit_length() - 1))
            inner = Scope(scope.function, scope)
            inner.names[node.target.id] = Lane(at)
            if self.run(node.body, inner) is not None:
                raise Refusal("a return in a loop over lanes")
            at += self.lane_count
        self.lane_count = 0
        _release({name: scope.names.get(name) for name in inner.names}, scope, "assigned in a loop over lanes")

    def _over_range(self, node: ast.For, limits: list[Any], known: bool, scope: Scope) -> Returned | None:
        items = range(*limits) if known else range(0)
        if known and len(items) <= self.unrolled and (self.lane_count or not leaves_loop(node.body)):
            return self._written_out(node, items, scope)
        if self.lane_count and not known:
            raise Refusal("a loop in a loop over lanes has a number of turns that is known")
        if not isinstance(node.target, ast.Name):
            raise Refusal("a loop over a range has one index")
        self._looped(node, node.target.id, limits, bool(items), scope)
        return None

    def _looped(self, node: ast.For, name: str, limits: list[object], turns: bool, scope: Scope) -> None:
        """A loop over a range, as a loop: inside a loop over lanes, its variables are
        vectors. ``turns`` if it is known to have one."""
        text = self.text
        start, stop, step = [0, limits[0], 1] if len(limits) == 1 else [*limits, 1][:3]
        if not isinstance(step, int) or step == 0:
            raise Refusal("the step of a range is known")
        every = set(assigned(node.body)) - {name}
        # In a loop over lanes what is new in each turn, such as a place in the buffer, needs
        # no place in memory.
        changed = every & (carried(node.body) | _numbers(scope)) if self.lane_count else every
        before = set(scope.names)
        without = self.open(sorted(changed), scope)
        held = scope.names.get(name)
        counter = text.slot("i")
        text.store(self.value(start, "i", wide=False), counter)
        last = self.value(stop, "i", wide=False)
        head, body, more, after = (text.block(label) for label in ("head", "body", "more", "after"))
        text.branch(head)
        text.begin(head)
        now = text.load(counter, "i")
        text.branch_if(text.comparison("slt" if step > 0 else "sgt", now, last), body, after)
        text.begin(body)
        scope.names[name] = now
        self._turn(node.body, scope, more, after)
        text.begin(more)
        text.store(text.operation("add", now, text.constant(step, "i")), counter)
        text.branch(head)
        text.begin(after)
        if not turns:
            _forget(without)
        new = (every | set(scope.names)) - before - changed | (every - changed)
        new = {n for n in new if n in scope.names and not isinstance(scope.names[n], Slot)}
        _release({**dict.fromkeys(new), name: held}, scope, "assigned in the turns of a loop")


def _numbers(scope: Scope) -> set[str]:
    """The names of the scope that are numbers with a value."""
    return {name for name, found in scope.names.items() if isinstance(found, (Value, Slot)) or is_number(found)}


def _forget(slots: dict[str, Slot]) -> None:
    """These names have no value here, as they are assigned on some ways only."""
    for name, slot in slots.items():
        slot.reason = slot.reason or (f"{name} has no value here; allowed: a name that is assigned on every way here")


def _release(before: dict[str, object], scope: Scope, what: str) -> None:
    """Names that are ``what`` have no value after the loop; those that a branch around
    it assigns keep their place in memory."""
    for name, found in before.items():
        reason = f"{name} is {what}, and has no value after it; allowed: another name, or a row of the buffer"
        if isinstance(found, Slot):
            found.reason = reason
            scope.names[name] = found
        else:
            scope.names[name] = Unassigned(reason)


def _placed(error: Exception, statement: ast.stmt, scope: Scope) -> LanguageError:
    """The refusal with its place."""
    code = scope.function.__code__
    text = str(error) or type(error).__name__
    line = f"{code.co_filename}, line {statement.lineno}"
    quoted = ast.unparse(statement).splitlines()[0].removesuffix(":")
    return LanguageError(f"{line}: {code.co_name}: {quoted}: {text}.")
