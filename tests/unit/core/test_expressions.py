"""Formulas: what they may consist of."""

import ast

import pytest

from proofroll.core.errors import InputError
from proofroll.core.expressions import evaluated
from proofroll.elements.mechanism.scene.signal import Formula
from proofroll.elements.mechanism.scene.spring_law import SpringLaw

# An expression of each kind that Python's grammar has and arithmetic does not.
_OTHERS = {
    "BoolOp": "1 and 2",
    "NamedExpr": "(a := 2)",
    "Lambda": "(lambda: 2)()",
    "IfExp": "1 if 2 else 3",
    "Dict": "{1: 2}",
    "Set": "{1}",
    "ListComp": "[1 for a in (1,)]",
    "SetComp": "{1 for a in (1,)}",
    "DictComp": "{1: 1 for a in (1,)}",
    "GeneratorExp": "max(a for a in (1, 2))",
    "Await": "await 1",
    "Yield": "(yield 1)",
    "YieldFrom": "(yield from 1)",
    "Compare": "1 < 2",
    "FormattedValue": "f'{1:>9999999999}'",
    "JoinedStr": "f'1'",
    "TemplateStr": "t'1'",
    "Interpolation": "t'{1}'",
    "Attribute": "pi.real",
    "Subscript": "'abc'[9]",
    "Starred": "max(*(1, 2))",
    "List": "[1]",
    "Tuple": "(1, 2)",
    "Slice": "'abc'[1:2]",
}
_ALLOWED = {"BinOp", "UnaryOp", "Call", "Constant", "Name"}
_MORE = [
    "0x10",
    "0b1",
    "1_000",
    "1j",
    "True",
    "None",
    "'1'",
    "...",
    "not 1",
    "~1",
    "7 // 2",
    "7 % 2",
    "1 << 2",
    "1 @ 1",
]
_MORE += [
    "abs",
    "L^sin",
    "max(1, cos)",
    "1" + "0" * 309,
    "1 # 2",
    "max(1, key=2)",
    "sin(x=1)",
    "1;2",
    "1\\\n",
    "+".join("1" * 400),
    "9" * 501,
    "(" * 300,
    "²",
    "\0",
]


def _texts() -> list[str]:
    return [*_OTHERS.values(), *_MORE]


def test_each_kind_of_expression_is_looked_at() -> None:
    """Every kind of expression of Python's grammar is allowed or has an example that is refused."""
    kinds = {kind.__name__ for kind in ast.expr.__subclasses__()} - {"Num", "Str", "Bytes", "NameConstant", "Ellipsis"}
    assert kinds - _ALLOWED - {"Constant"} <= set(_OTHERS)


@pytest.mark.parametrize("text", _texts())
def test_what_is_no_arithmetic_is_refused(text: str) -> None:
    """A formula of a parameter, of time and of a spring with anything but arithmetic is refused in one line."""
    for read in (lambda: evaluated("mass", text, {}), lambda: Formula(text), lambda: SpringLaw(text)):
        with pytest.raises(InputError) as caught:
            read()
        assert "\n" not in str(caught.value)


def test_python_warns_of_no_formula(recwarn: pytest.WarningsRecorder) -> None:
    """What Python's own parser only warns of is refused without its warnings."""
    with pytest.raises(InputError):
        evaluated("mass", "1if 1else 2", {})
    assert not recwarn.list


@pytest.mark.parametrize(
    ("text", "value"), [("1e-3*2.", 2e-3), (".5^2", 0.25), ("-(+2)**3", -8.0), ("max(1,\n 2E0)", 2.0), ("9" * 20, 1e20)]
)
def test_arithmetic_is_evaluated(text: str, value: float) -> None:
    """Numbers, signs, powers, calls and line breaks in brackets give the value of arithmetic."""
    assert evaluated("mass", text, {}) == pytest.approx(value)
    assert Formula(text).at(0.0) == pytest.approx(value)
