"""Expressions: Python's own arithmetic is the oracle for values; errors state their place in the text."""

from __future__ import annotations

import ast
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kinfmu.errors import MechanismError
from kinfmu.mechanism import toml_file
from kinfmu.mechanism.expression import DEEPEST, LARGEST_POWER, LONGEST, Expression
from kinfmu.mechanism.number import given_unit, read_number
from kinfmu.mechanism.operations import Dimension
from kinfmu.plan.equations.graph import Graph, evaluate
from kinfmu.plan.equations.taylor import Taylor
from kinfmu.units import Quantity, spelled

VALUES = {"a": 2.0, "b": -0.75, "long_name_2": 1e3}
FUNCTIONS = {name: getattr(math, name) for name in ("sin", "cos", "tan", "sqrt", "asin", "acos", "atan2")}


def message_of(text: str, values: dict[str, float] | None = None) -> str:
    """Return the message about a wrong expression."""
    with pytest.raises(MechanismError) as caught:
        Expression(text).value(VALUES if values is None else values)
    message = str(caught.value)
    assert message.splitlines() == [message]
    assert len(message) < 400
    return message


def by_python(text: str) -> float:
    """Return the value as Python computes it."""
    code = compile(ast.parse(text, mode="eval"), "expression", "eval")
    return float(eval(code, {"__builtins__": {}, "pi": math.pi, **FUNCTIONS, **VALUES}))  # noqa: S307  only in the test


@pytest.mark.parametrize(
    "text",
    [
        "1",
        "1.5e-3 + .5 + 2.",
        "2*a + b",
        "a - b - 3",
        "a/b/4*2",
        "-a**2",
        "(-a)**2",
        "2**-2*a",
        "a**0",
        "a - -b + +3",
        "--a",
        "-(a + b)*(a - b)",
        "sin(a*b) + cos(pi/3)",
        "sqrt(a**2 + b**2)/long_name_2",
        "2e3*(a)",
        "tan(b) + atan2(b, -a)",
        "asin(b) + acos(b)*asin(1) - acos(-1)",
        "atan2(sin(a), cos(a))",
        "((((a))))",
    ],
)
def test_an_expression_has_the_value_that_arithmetic_gives(text: str) -> None:
    assert Expression(text).value(VALUES) == pytest.approx(by_python(text), rel=4e-16)


@st.composite
def expressions(draw: st.DrawFn, depth: int = 3) -> str:
    """Draw the text of a random expression."""
    if depth == 0 or draw(st.booleans()):
        return draw(st.sampled_from(["a", "b", "long_name_2", "pi", "0.5", "3", "1e-2"]))
    one, other = draw(expressions(depth=depth - 1)), draw(expressions(depth=depth - 1))
    operator = draw(st.sampled_from(["+", " - ", "*", " / "]))
    shape = draw(
        st.sampled_from(
            ["{0}{2}{1}", "({0}{2}{1})", "-{0}{2}{1}", "sin({0}){2}cos({1})", "atan2({0}, {1})", "({0}){2}({1})**2"]
        )
    )
    return shape.format(one, other, operator)


@given(text=expressions())
def test_any_expression_has_the_value_that_arithmetic_gives(text: str) -> None:
    try:
        expected = by_python(text)
    except ZeroDivisionError:
        assert "division by zero" in message_of(text)
    else:
        assert Expression(text).value(VALUES) == pytest.approx(expected, rel=1e-12, abs=1e-12)


@given(text=expressions())
def test_symbols_and_numbers_give_the_same_to_the_bit(text: str) -> None:
    expression = Expression(text)
    graph = Graph()
    try:
        node = graph.lift(expression.value({name: graph.symbol(name) for name in VALUES}))
        (traced,) = evaluate([node], VALUES)
        direct = expression.value(VALUES)
    except (MechanismError, ZeroDivisionError):
        return  # both paths are refused where the divisor is a constant zero; tested elsewhere
    assert traced == direct


def test_taylor_numbers_give_derivatives() -> None:
    value = Expression("sqrt(a)*sin(a) - 1/a**2 + tan(a)").value({"a": Taylor.of(2, 2.0, 1.0)})
    root, s, c = math.sqrt(2.0), math.sin(2.0), math.cos(2.0)
    assert value.derivative(1) == pytest.approx(s / (2.0 * root) + root * c + 2.0 / 8.0 + 1.0 / c**2, rel=1e-14)


def test_arrays_are_values_too() -> None:
    values = Expression("2*a + 1").value({"a": np.array([1.0, 2.0])})
    assert values.tolist() == [3.0, 5.0]


def test_numbers_with_units_are_converted_to_the_units_used_inside() -> None:
    assert Expression("2*a + 5 mm", "m").value({"a": 1.0}) == 2.005
    assert Expression("5mm + 1 cm", "mm").value({}) == 15.0
    assert Expression("sin(30 deg)").value({}) == pytest.approx(0.5, rel=1e-15)
    assert Expression("acos(0.5) - 60 deg").value({}) == pytest.approx(0.0, abs=1e-15)
    assert Expression("90 deg + 1 rad").value({}) == math.pi / 2 + 1.0
    assert Expression("10 mm/s", "mm").value({}) == 10.0
    assert Expression("30 rpm").value({}) == pytest.approx(math.pi, rel=1e-15)
    assert Expression("10 mm/s", "mm").names == ()
    assert Expression("10 mm / s", "mm").names == ("s",)
    assert Expression("10 mm/a", "mm").value({"a": 2.0}) == 5.0


def test_names_of_an_expression_are_listed_once_and_in_order() -> None:
    assert Expression("b + a*b - pi + sin(c)").names == ("b", "a", "c")


def test_an_expression_is_a_value() -> None:
    assert Expression(" a + 1 ") == Expression("a + 1")
    assert hash(Expression("a + 1")) == hash(Expression(" a + 1"))
    assert Expression("a + 1") != Expression("a+1")
    assert Expression("a", "mm") != Expression("a", "m")
    assert repr(Expression("a + 1")) == "Expression('a + 1')"


ALL = "sin, cos, tan, sqrt, asin, acos, atan2"
MESSAGES = {
    "": "'', character 1: expected a number, a name or '(', found the end",
    "2 * (a + ": "'2 * (a +', character 9: expected a number, a name or '(', found the end",
    "2 * (a": "'2 * (a', character 7: expected one of + - * / ** ), found the end",
    "a b": "'a b', character 3: expected one of + - * / **, found 'b'",
    "a)": "'a)', character 2: expected one of + - * / **, found ')'",
    "a + * b": "'a + * b', character 5: expected a number, a name or '(', found '*'",
    "a & b": "'a & b', character 3: expected one of + - * / **, found '&'",
    "a\nb": r"'a\nb', character 2: expected one of + - * / **, found '\n'",
    "a^2": "'a^2', character 2: powers are written with **",
    "4 kg m^2": "'4 kg m^2', character 3: no unit 'kg m^2'; did you mean 'kg m2'?",
    "4 kg m**2": "'4 kg m**2', character 3: no unit 'kg m**2'; did you mean 'kg m2'?",
    "4 kg m\N{SUPERSCRIPT TWO}": "'4 kg m\N{SUPERSCRIPT TWO}', character 3: no unit 'kg m\N{SUPERSCRIPT TWO}'; "
    "did you mean 'kg m2'?",
    "3 m/s^2 + a": "'3 m/s^2 + a', character 3: no unit 'm/s^2'; did you mean 'm/s2'?",
    "3 N\N{MIDDLE DOT}m": "'3 N\N{MIDDLE DOT}m', character 3: no unit 'N\N{MIDDLE DOT}m'; did you mean 'N m'?",
    "a**0.5": "'a**0.5', character 4: expected a whole number as exponent, found '0.5'",
    "a**b": "'a**b', character 4: expected a whole number as exponent, found 'b'",
    "a**100": f"'a**100', character 4: expected an exponent up to {LARGEST_POWER}, found '100'",
    "a**2**3": "'a**2**3', character 5: expected parentheses around a power of a power, found '**'",
    "a + lng_name_2": (
        "'a + lng_name_2', character 5: no parameter 'lng_name_2'; did you mean 'long_name_2'?; "
        "parameters: a, b, long_name_2"
    ),
    "sine(a)": f"'sine(a)', character 1: no function 'sine'; did you mean 'sin'?; functions: {ALL}",
    "sin a": "'sin a', character 5: expected '(' after sin, found 'a'",
    "sin(a, b)": "'sin(a, b)', character 6: expected one of + - * / ** ), found ','",
    "a/(b + 0.75)": "'a/(b + 0.75)', character 2: division by zero",
    "(a - 2)**-1": "'(a - 2)**-1', character 8: division by zero",
    "sqrt(b)": "'sqrt(b)', character 1: sqrt of -0.75 is undefined",
    "acos(a)": "'acos(a)', character 1: acos of 2.0 is undefined",
    "atan2(a)": "'atan2(a)', character 8: expected one of + - * / ** ,, found ')'",
    "1e300*1e300": "'1e300*1e300', character 6: the number is too large",
    "1e999": "'1e999', character 1: the number is too large",
    "2 parsec": (
        "'2 parsec', character 3: no unit 'parsec'; "
        "units: m, mm, cm, um, km, in, ft, rad, deg, rev, s, ms, min, h, rpm, Hz, kg, g, t, lb, N, mN, kN, MN, "
        "lbf, Nm, mNm, kNm, Nmm, J, mJ, kJ, W, mW, kW, "
        "and such as mm/s, rad/s2, N m; "
        "a product needs *"
    ),
    "2a": (
        "'2a', character 2: no unit 'a'; "
        "units: m, mm, cm, um, km, in, ft, rad, deg, rev, s, ms, min, h, rpm, Hz, kg, g, t, lb, N, mN, kN, MN, "
        "lbf, Nm, mNm, kNm, Nmm, J, mJ, kJ, W, mW, kW, "
        "and such as mm/s, rad/s2, N m; "
        "a product needs *"
    ),
    "nan": "'nan', character 1: no parameter 'nan'; did you mean 'tan'?; parameters: a, b, long_name_2",
    "__import__('os')": f"'__import__('os')', character 1: no function '__import__'; functions: {ALL}",
    "a.real": "'a.real', character 1: no parameter 'a.real'; parameters: a, b, long_name_2",
}


@pytest.mark.parametrize("text", MESSAGES)
def test_an_error_is_reported_with_its_place(text: str) -> None:
    assert message_of(text).replace('"', "'") == MESSAGES[text]


def test_long_and_deep_expressions_are_refused_quickly() -> None:
    assert message_of("+".join("a" * LONGEST)).endswith(f"is too long for an expression; {LONGEST} characters at most")
    deep = "(" * 400 + "a" + ")" * 400
    assert message_of(deep).endswith(f"character {DEEPEST + 1}: parentheses more than {DEEPEST} deep")
    assert message_of("sin(" * 200).endswith(f"parentheses more than {DEEPEST} deep")
    assert Expression("(" * DEEPEST + "a" + ")" * DEEPEST).value(VALUES) == 2.0
    assert Expression("-" * (LONGEST - 1) + "a").value(VALUES) == -2.0
    assert Expression("+".join("a" * (LONGEST // 2))).value(VALUES) == LONGEST


@given(text=st.text(max_size=20))
def test_any_text_is_an_expression_or_a_message_of_one_line(text: str) -> None:
    try:
        Expression(text).value(VALUES)
    except MechanismError as error:
        message = str(error)
        assert message.splitlines() == [message]
        assert message.isprintable()


LENGTH, ANGLE, NUMBER = Quantity("length"), Quantity("angle"), Quantity("number")
DIMENSIONS = {"r": Dimension.of(LENGTH), "phi": Dimension.of(ANGLE), "w": Dimension.of(Quantity("angle", 1))}


@pytest.mark.parametrize(
    ("text", "quantity"),
    [
        ("2*r + 5 mm", LENGTH),
        ("r + 5", LENGTH),
        ("r*phi", LENGTH),
        ("sqrt(r**2 + (3 mm)**2)", LENGTH),
        ("r*sin(phi)/2", LENGTH),
        ("r/r", NUMBER),
        ("r/2", LENGTH),
        ("phi/2 - pi", ANGLE),
        ("sin(phi)", NUMBER),
        ("atan2(r, r)", ANGLE),
        ("asin(r/r)", ANGLE),
        ("asin(r/r)/2 + 30 deg", ANGLE),
        ("w", Quantity("angle", 1)),
        ("w*(2 s)", ANGLE),
        ("w*r", Quantity("length", 1)),
        ("w**2*r", Quantity("length", 2)),
        ("r*r", None),  # files have no unit for it
        ("3", None),  # a bare number takes the unit of its place
        ("3*r/r", None),
        ("unknown", None),
        ("unknown + r", LENGTH),
    ],
)
def test_what_an_expression_measures_follows_from_its_parameters(text: str, quantity: Quantity | None) -> None:
    assert Expression(text).dimension(DIMENSIONS).quantity == quantity


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("r + phi", "character 3: '+': a length and an angle cannot be added"),
        ("r*r - r", "character 5: '-': length^2 and a length cannot be added"),
        ("w + phi", "character 3: '+': an angular speed and an angle cannot be added"),
        ("sin(r)", "character 1: 'sin': an angle is needed, not a length"),
        ("asin(r)", "character 1: 'asin': a number is needed, not a length"),
        (
            "atan2(r, phi)",
            "character 1: 'atan2': two quantities of the same kind are needed, not a length and an angle",
        ),
        ("5 mm + 3 s", "character 6: '+': a length and a time cannot be added"),
        ("sqrt(r) + r", "character 9: '+': length^1/2 and a length cannot be added"),
    ],
)
def test_incompatible_quantities_are_reported(text: str, what: str) -> None:
    with pytest.raises(MechanismError) as caught:
        Expression(text).dimension(DIMENSIONS)
    assert str(caught.value) == f"'{text}', {what}"


def test_an_inch_sign_within_an_expression_suggests_a_unit() -> None:
    with pytest.raises(MechanismError, match=r"; did you mean 'in'\?$"):
        Expression('2" + 1 mm')


def test_degree_sign_and_inch_are_units_of_rates_and_quotients_too() -> None:
    for text, same in (("90\N{DEGREE SIGN}/s", "90 deg/s"), ("3 lbf/inch", "3 lbf/in"), ("r + 2inch", "r + 2 in")):
        values = {"r": 1.0}
        assert Expression(text).value(values) == Expression(same).value(values)
        assert Expression(text).dimension(DIMENSIONS) == Expression(same).dimension(DIMENSIONS)
    with pytest.raises(MechanismError, match="expected one of"):
        Expression("60\N{DEGREE SIGN}\N{DEGREE SIGN}")


@pytest.mark.parametrize(
    ("written", "newton"),
    [("5 N + 3", 8.0), ("3 + 5 N", 8.0), ("1 + 2 + 5 N - 3", 5.0), ("2*p - 3", 7.0), ("m*9.81 m/s2 + 3", 22.62)],
)
def test_a_bare_number_added_to_a_force_is_in_newtons_in_every_file(written: str, newton: float) -> None:
    load = f'[loads.push]\ntype = "force"\nat = "crank.O"\nx = "{written}"\ny = 0\n'
    lines = ['[parameters]\np = "5 N"\nm = "2 kg"\n', load]
    for unit in ("m", "mm"):
        head = (
            f'name = "wheel"\n[units]\nlength = "{unit}"\n[bodies.ground]\npoints = {{ O = [0, 0] }}\n[bodies.crank]\n'
        )
        joint = 'points = { O = [0, 0] }\n[joints.O]\ntype = "revolute"\nbetween = ["ground.O", "crank.O"]\n'
        driver = '[drivers.crank]\ntype = "angle"\nof = "crank"\nlaw = "constant_speed"\nspeed = 1.0\n'
        mechanism = toml_file.parse(head + joint + driver + "".join(lines))
        for one in (mechanism, mechanism.in_metres()):
            assert one.loads[0].x == pytest.approx(newton, rel=1e-15)


@pytest.mark.parametrize(
    ("text", "quantity", "value"),
    [
        ("1/360 s", Quantity("time"), 1.0 / 360.0),
        ("-2/3 mm", Quantity("length"), -2.0 / 3000.0),
        ("360/7 deg", Quantity("angle"), math.tau / 7.0),
        ("360/7\N{DEGREE SIGN}", Quantity("angle"), math.tau / 7.0),
        ("1/3 rev", Quantity("angle"), math.tau / 3.0),
        (" 1e2/3 rad/s ", Quantity("angle", 1), 100.0 / 3.0),
        ("2/3 N m", Quantity("torque"), 2.0 / 3.0),
    ],
)
def test_the_unit_of_a_quotient_belongs_to_both_numbers(text: str, quantity: Quantity, value: float) -> None:
    found = read_number("x", text, quantity, "m")
    assert found == pytest.approx(value, rel=1e-15)
    assert (found.text, given_unit(found)) == (text, spelled(text.lstrip("-0123456789e/ ").strip()))  # type: ignore[union-attr]


@pytest.mark.parametrize("text", ["1/0 s", "1 s/2", "a/2", "1/2", "a/2 s"])
def test_other_divisions_are_expressions_as_before(text: str) -> None:
    assert read_number("x", text, Quantity("time"), "m") == Expression(text, "m")


def test_a_quotient_with_an_unknown_unit_is_reported_as_it_is_written() -> None:
    with pytest.raises(MechanismError, match="'1/2 crank', character 5: no unit 'crank'"):
        read_number("x", "1/2 crank", Quantity("length"), "m")
