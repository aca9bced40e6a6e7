"""Parameters: geometry refers to them by name, in files and in Python, with other values, in other arithmetic."""

from __future__ import annotations

import copy
import math
from dataclasses import replace
from typing import Any

import pytest

from kinfmu.errors import MechanismError, RequestError
from kinfmu.mechanism import Body, Mechanism, Parameter, RunSettings
from kinfmu.mechanism.drivers import AngleDriver
from kinfmu.mechanism.expression import Expression
from kinfmu.mechanism.joints import Coordinate, Distance, Gear, PointOnLine, Revolute, Translational
from kinfmu.mechanism.laws import ConstantSpeed
from kinfmu.mechanism.toml_file import parse
from kinfmu.mechanism.toml_text import text
from kinfmu.plan.equations.graph import Graph, evaluate
from kinfmu.plan.origin import localized
from kinfmu.run.solve import solve
from kinfmu.units import Quantity

FOURBAR = """
name = "fourbar"
[units]
length = "mm"
[parameters]
tip = "crank/2 + 5 mm"
crank = "40 mm"
ground = { value = "4 in", description = "between the pivots" }
rod = 110.0
ratio = 1.1
tilt = "30 deg"
turn = "6 rpm"
[bodies.ground]
points = { O = [0, 0], C = ["ground", 0] }
[bodies.crank]
points = { O = [0, 0], P = ["crank", 0], tip = [0, "tip"] }
start = { phi = "2*tilt" }
[bodies.rocker]
points = { C = [0, 0], Q = ["70 mm * ratio", 0] }
start = { x = "ground", phi = 1.7 }
[joints]
O = { type = "revolute", between = ["ground.O", "crank.O"] }
C = { type = "revolute", between = ["ground.C", "rocker.C"] }
rod = { type = "distance", between = ["crank.P", "rocker.Q"], length = "rod" }
[drivers]
crank = { type = "angle", of = "crank", law = "constant_speed", start = "2*tilt", speed = "turn" }
[run]
stop = "1 min / 6"
"""


def test_a_file_with_parameters_has_its_numbers() -> None:
    mechanism = parse(FOURBAR)
    ground, crank, rocker = mechanism.bodies
    assert ground.points["C"] == (101.6, 0.0)
    assert crank.points["P"] == (40.0, 0.0)
    assert crank.points["tip"] == (0.0, 25.0)
    assert crank.start.phi == 2.0 * (30.0 * (math.pi / 180.0))
    assert rocker.points["Q"] == (70.0 * 1.1, 0.0)
    assert mechanism.joints[2].length == 110.0  # type: ignore[attr-defined]
    assert mechanism.drivers[0].law.speed == 6.0 * (2.0 * math.pi / 60.0)  # type: ignore[attr-defined]
    assert mechanism.run == RunSettings(0.0, 10.0, 0.01)


def test_parameters_keep_their_order_description_and_quantity() -> None:
    parameters = parse(FOURBAR).parameters
    assert list(parameters) == ["tip", "crank", "ground", "rod", "ratio", "tilt", "turn"]
    assert parameters["ground"] == Parameter(101.6, Quantity("length"), "between the pivots")
    assert parameters["tip"].expression == Expression("crank/2 + 5 mm", "mm")
    assert parameters["crank"].expression is None
    kinds = {name: parameter.kind for name, parameter in parameters.items()}
    assert kinds == {
        "tip": "length",
        "crank": "length",
        "ground": "length",
        "rod": "length",  # from its place
        "ratio": "number",
        "tilt": "angle",
        "turn": "angle",
    }
    assert parameters["turn"].quantity == Quantity("angle", 1)


def test_expressions_are_listed_by_path() -> None:
    expressions = parse(FOURBAR).expressions
    assert {place: expression.text for place, expression in expressions.items()} == {
        ("bodies", "ground", "points", "C", 0): "ground",
        ("bodies", "crank", "points", "P", 0): "crank",
        ("bodies", "crank", "points", "tip", 1): "tip",
        ("bodies", "crank", "start", "phi"): "2*tilt",
        ("bodies", "rocker", "points", "Q", 0): "70 mm * ratio",
        ("bodies", "rocker", "start", "x"): "ground",
        ("joints", "rod", "length"): "rod",
        ("drivers", "crank", "law", "start"): "2*tilt",
        ("drivers", "crank", "law", "speed"): "turn",
        ("run", "stop"): "1 min / 6",
    }


def test_a_parameter_keeps_the_unit_of_a_rate_over_a_length() -> None:
    mechanism = parse('name = "a"\nparameters = { slope = "2 deg/mm" }\n[bodies.bar]\n')
    assert mechanism.parameters["slope"].quantity == Quantity("angle", 1, "length")
    assert mechanism.parameters["slope"].value == pytest.approx(2000.0 * math.pi / 180.0, rel=1e-15)
    assert parse(text(mechanism)) == mechanism


def test_a_written_mechanism_is_read_back_with_its_expressions() -> None:
    mechanism = parse(FOURBAR)
    again = parse(text(mechanism))
    assert again == mechanism
    assert hash(again) == hash(mechanism)
    assert again.parameters == mechanism.parameters
    assert again.expressions == mechanism.expressions
    assert text(again) == text(mechanism)
    assert 'tip = "crank/2 + 5 mm"' in text(mechanism)
    assert 'ground = { value = "101.6 mm", description = "between the pivots" }' in text(mechanism)


def test_python_and_a_file_give_the_same_mechanism() -> None:
    mechanism = Mechanism(
        "fourbar",
        (
            Body("ground", {"O": (0, 0), "C": ("ground", 0)}),
            Body("crank", {"O": (0, 0), "P": ("crank", 0), "tip": (0, "tip")}, (None, None, "2*tilt")),
            Body("rocker", {"C": (0, 0), "Q": ("70 mm * ratio", 0)}, ("ground", None, 1.7)),
        ),
        (
            Revolute("O", ("ground.O", "crank.O")),
            Revolute("C", ("ground.C", "rocker.C")),
            Distance("rod", ("crank.P", "rocker.Q"), "rod"),
        ),
        (AngleDriver("crank", "crank", ConstantSpeed("2*tilt", "turn")),),
        run=RunSettings(stop="1 min / 6"),
        length_unit="mm",
        parameters={
            "tip": "crank/2 + 5 mm",
            "crank": "40 mm",
            "ground": Parameter("4 in", description="between the pivots"),
            "rod": 110,
            "ratio": 1.1,
            "tilt": "30 deg",
            "turn": "6 rpm",
        },
    )
    assert mechanism == parse(FOURBAR)


def test_a_number_and_an_expression_of_its_value_are_not_the_same() -> None:
    def written(length: str) -> Mechanism:
        return parse(FOURBAR.replace('length = "rod"', f"length = {length}"))

    assert written('"rod"') != written("110.0")
    assert written("110.0") == written("110.0")


def test_set_values_recompute_the_expressions() -> None:
    mechanism = parse(FOURBAR).with_parameters({"crank": "5 cm", "tilt": 0.25, "rod": "2*crank + 8 mm"})
    assert mechanism == parse(
        FOURBAR.replace("40 mm", "50 mm").replace('"30 deg"', '"0.25 rad"').replace("110.0", '"2*crank + 8 mm"')
    )
    assert mechanism.bodies[1].points["tip"] == (0.0, 30.0)
    assert mechanism.joints[2].length == 108.0  # type: ignore[attr-defined]


def test_replacing_another_field_keeps_the_expressions() -> None:
    mechanism = parse(FOURBAR)
    other = replace(mechanism, joints=(*mechanism.joints[:2], replace(mechanism.joints[2], length=90.0)), name="other")
    assert ("joints", "rod", "length") not in other.expressions
    moved = other.with_parameters({"rod": 120, "crank": 50})
    assert moved.joints[2].length == 90.0  # type: ignore[attr-defined]
    assert moved.bodies[1].points["P"] == (50.0, 0.0)


def test_another_unit_of_length_parses_expressions_again() -> None:
    mechanism = Mechanism("a", (Body("bar", {"P": ("a + 5 mm", 0)}),), length_unit="mm", parameters={"a": 1.0})
    assert mechanism.bodies[1].points["P"].x == 6.0
    assert replace(mechanism, length_unit="m").bodies[1].points["P"].x == 1.005


def test_copies_keep_the_expressions() -> None:
    length = parse(FOURBAR).joints[2].length  # type: ignore[attr-defined]
    again = copy.deepcopy(length)
    assert again == length
    assert again.expression == length.expression


def test_the_members_are_available_in_any_arithmetic() -> None:
    mechanism = parse(FOURBAR)
    graph = Graph()
    at = mechanism.at({"crank": graph.symbol("crank"), "tilt": graph.symbol("tilt")})
    assert at.body_points["ground.C"] == (101.6, 0.0)
    assert at.body_points["crank.P"] == (graph.symbol("crank"), 0.0)
    tip, phi = at.body_points["crank.tip"][1], at.bodies[1].start.phi
    assert evaluate([tip, phi], {"crank": 60.0, "tilt": 0.5}) == [35.0, 1.0]
    assert evaluate([at.drivers[0].law.start], {"tilt": 0.5}) == [1.0]  # type: ignore[attr-defined]
    assert at.joints[2] == mechanism.joints[2]
    assert at.run == mechanism.run
    assert mechanism.at({"crank": 40.0}) == mechanism.members
    assert mechanism.at({"tip": 1.0}).body_points["crank.tip"] == (0.0, 1.0)


def test_a_tilted_guide_may_have_a_symbol_for_its_angle() -> None:
    mechanism = Mechanism(
        "guide",
        (Body("ground", {"O": (0, 0)}), Body("bar", {"P": (0, 0)})),
        (PointOnLine("guide", ("ground.O", "bar.P"), "tilt"),),
        parameters={"tilt": "30 deg"},
    )
    assert mechanism.expressions == {("joints", "guide", "axis"): Expression("tilt")}
    graph = Graph()
    (guide,) = mechanism.at({"tilt": graph.symbol("tilt")}).joints
    from kinfmu.mechanism.quantities.placement import GROUND, BodyFrame, Placement

    at = Placement({"ground": GROUND, "bar": BodyFrame.of(2.0, 3.0, 0.0)}, mechanism.body_points)
    (row,) = guide.residual(at)
    (value,) = evaluate([row], {"tilt": 0.5})
    assert value == pytest.approx(3.0 * math.cos(0.5) - 2.0 * math.sin(0.5), rel=1e-15)


def test_the_origin_of_the_plan_shifts_expressions_too() -> None:
    far = FOURBAR.replace('C = ["ground", 0]', 'C = ["ground + 1000 m", 0]').replace("O = [0, 0], C", "O = [1e6, 0], C")
    far = far.replace('x = "ground"', 'x = "ground + 1000 m"').replace('phi = "2*tilt"', 'x = 1e6, phi = "2*tilt"')
    mechanism = parse(far)
    local, origin = localized(mechanism)
    assert origin == (1e6, 0.0)
    assert local.body_points["ground.C"][0] == pytest.approx(101.6, rel=1e-8)
    assert local.with_parameters({"ground": 90.0}).body_points["ground.C"] == (90.0, 0.0)
    graph = Graph()
    x, _ = local.at({"ground": graph.symbol("ground")}).body_points["ground.C"]
    assert evaluate([x], {"ground": 90.0}) == [90.0]


def test_a_guide_that_holds_a_coordinate_moves_with_the_origin() -> None:
    mechanism = Mechanism(
        "slider",
        (Body("ground", {"O": ("far", 0)}), Body("bar", {"P": (0, 0)}, ("far", None, None))),
        (Coordinate("guide", "bar.P", "x", "far + 1"), Distance("rod", ("ground.O", "bar.P"), 2.0)),
        parameters={"far": 1000.0},
    )
    local, _ = localized(mechanism)
    assert local.joints[0].value == 1.0  # type: ignore[attr-defined]
    assert local.with_parameters({"far": 1002.0}).joints[0].value == 3.0  # type: ignore[attr-defined]


def test_solving_with_parameters_equals_solving_with_their_numbers() -> None:
    mechanism = parse(FOURBAR)
    numbers = parse(
        FOURBAR[: FOURBAR.index("[parameters]")]
        + FOURBAR[FOURBAR.index("[bodies.ground]") :]
        .replace('["ground", 0]', "[101.6, 0]")
        .replace('["crank", 0]', "[40, 0]")
        .replace('[0, "tip"]', "[0, 25]")
        .replace('"2*tilt"', '"60 deg"')
        .replace('"70 mm * ratio"', "77.0")
        .replace('x = "ground"', "x = 101.6")
        .replace('length = "rod"', "length = 110")
        .replace('"turn"', '"6 rpm"')
    )
    one, other = (solve(mech, [0.0, 0.1, 0.2]) for mech in (mechanism, numbers))
    assert one["rocker.phi"] == pytest.approx(other["rocker.phi"], abs=1e-13)


def message_of(changes: dict[str, Any] | None = None, joint: Any = None) -> str:
    """Return the message about a bar with these parameters."""
    joints = (joint,) if joint else ()
    bodies = (Body("ground", {"O": (0, 0)}), Body("bar", {"P": ("a", 0)}), Body("arm", {"Q": (0, 0)}))
    with pytest.raises(MechanismError) as caught:
        Mechanism("a", bodies, joints, parameters={"a": 1.0, **(changes or {})})
    message = str(caught.value)
    assert message.splitlines() == [message]
    return message


WORDS = "sin, cos, tan, sqrt, asin, acos, atan2, pi"


@pytest.mark.parametrize(
    ("parameters", "what"),
    [
        ({"a": "b", "b": "c + 1", "c": "2*a"}, "[parameters] a needs itself: a -> b -> c -> a"),
        ({"b": "b"}, "[parameters] b needs itself: b -> b"),
        ({"b": "aa"}, "[parameters] b = 'aa', character 1: no parameter 'aa'; did you mean 'a'?; parameters: a, b"),
        ({"b": "a +"}, "[parameters] b = 'a +', character 4: expected a number, a name or '(', found the end"),
        ({"b": "1/(a - 1)"}, "[parameters] b = '1/(a - 1)', character 2: division by zero"),
        ({"b": "a*1e31"}, "[parameters] b = 'a*1e31' = 1e+31 is too large; numbers go up to 1e+30"),
        ({"b": math.nan}, "[parameters] b = nan must be a finite number"),
        ({"b": [1]}, "[parameters] b = [1] must be a number or text such as '2*a'"),
        ({"b": True}, "[parameters] b = true must be a number or text such as '2*a'"),
        (
            {"sin": 1.0},
            f"[parameters] sin: this name is reserved in expressions; reserved: {WORDS}",
        ),
        (
            {"pi": 3.0},
            f"[parameters] pi: this name is reserved in expressions; reserved: {WORDS}",
        ),
        (
            {"2a": 1.0},
            "[parameters] '2a' must consist of at most 100 letters, digits and underscores, and not begin with a digit",
        ),
        ({"b": "1 s", "c": "a + b"}, "[parameters] c = 'a + b', character 3: '+': a length and a time cannot be added"),
        ({"a": "30 deg"}, "[bodies.bar] points.P = 'a' is an angle and must be a length"),
        ({"a": "1 deg/kg"}, "[parameters] a = '1 deg/kg', character 7: no parameter 'kg'; parameters: a"),
        (
            {"a": Parameter(1.0, description="two\nlines")},
            r"[parameters] a description = 'two\nlines' must be one line of text without control characters",
        ),
    ],
)
def test_invalid_parameters_are_refused(parameters: dict[str, Any], what: str) -> None:
    assert message_of(parameters) == what


def test_a_long_circle_is_shortened_in_the_message() -> None:
    circle = {f"p{k}": f"p{(k + 1) % 1000}" for k in range(1000)}
    message = message_of(circle)
    assert message.startswith("[parameters] p")
    assert " -> ... -> p" in message
    assert len(message) < 200


def test_a_chain_of_thousands_of_parameters_is_computed() -> None:
    chain = {"p0": 1.0, **{f"p{k}": f"p{k - 1} + 1" for k in range(1, 3000)}}
    mechanism = Mechanism("a", (Body("bar"),), parameters=dict(reversed(chain.items())))
    assert mechanism.parameters["p2999"].value == 3000.0


def test_an_invalid_value_is_reported_with_its_expression() -> None:
    rod = Distance("rod", ("ground.O", "bar.P"), "a - 2*b")  # type: ignore[arg-type]
    assert message_of({"b": 1.0}, rod) == (
        "[joints.rod] length = -1.0 must be a positive number, 1e-30 or more (length = 'a - 2*b', a = 1.0, b = 1.0)"
    )
    pair = Gear("pair", ("bar", "arm"), "a - 1")  # type: ignore[arg-type]
    assert message_of({}, pair).startswith("[joints.pair] ratio = 'a - 1' is a length and must be a number")
    assert message_of({"b": 1.0}, replace(pair, ratio="b - 1")) == (
        "[joints.pair] ratio = 0.0 must be other than 0 (ratio = 'b - 1', b = 1.0)"
    )


def test_the_message_of_an_unknown_name_names_its_place() -> None:
    guide = Coordinate("guide", "bar.P", "x", "2*b")  # type: ignore[arg-type]
    assert message_of({}, guide) == "[joints.guide] value = '2*b', character 3: no parameter 'b'; parameters: a"


@pytest.mark.parametrize(
    ("axis", "character", "what"),
    [
        ("y", 1, "no parameter 'y'; parameters: a"),
        ("-y", 2, "no parameter 'y'; parameters: a"),
        ("y-axis", 1, "no parameter 'y'; parameters: a"),
        ("Y axis", 3, "expected one of + - * / **, found 'axis'"),
    ],
)
def test_a_word_in_place_of_a_number_is_refused_with_the_quantity_needed(axis: str, character: int, what: str) -> None:
    slide = Translational("slide", ("ground.O", "bar.P"), axis)  # type: ignore[arg-type]
    needed = "[joints.slide] axis must be an angle, such as '60 deg'"
    assert message_of({}, slide) == f"{needed}: '{axis}', character {character}: {what}"


def test_a_parameter_with_the_name_of_an_input_is_refused() -> None:
    with pytest.raises(MechanismError, match=r"^\[parameters\] m_angle: driver 'm' has an input of this name already$"):
        Mechanism("a", (Body("bar"),), drivers=(AngleDriver("m", "bar"),), parameters={"m_angle": 1.0})


def test_set_values_that_are_invalid_are_refused() -> None:
    mechanism = parse(FOURBAR)

    def changed(**values: Any) -> str:
        with pytest.raises((RequestError, MechanismError)) as caught:
            mechanism.with_parameters(values)
        return str(caught.value)

    assert changed(crnk=1.0) == (
        "there is no parameter 'crnk'; did you mean 'crank'?; parameters: tip, crank, ground, rod, ratio, tilt, turn"
    )
    assert changed(crank="30 deg") == ("crank = '30 deg': unit 'deg' must be one of m, mm, cm, um, km, in, ft")
    assert changed(crank="tip") == "[parameters] tip needs itself: tip -> crank -> tip"
    assert changed(rod=-1.0) == (
        "[joints.rod] length = -1.0 must be a positive number, 1e-30 or more (length = 'rod', rod = -1.0)"
    )
    assert changed(ratio="10 mm") == "[bodies.rocker] points.Q = '70 mm * ratio' is length^2 and must be a length"


def test_constants_of_laws_are_set_by_name_unless_computed() -> None:
    fixed = FOURBAR.replace('start = "2*tilt"', "start = 0.25")
    mechanism = parse(fixed)
    assert [constant.name for constant in mechanism.law_constants] == ["crank.start"]
    (driver,) = mechanism.with_parameters({"crank.start": "45 deg"}).drivers
    assert driver.law.start == math.pi / 4  # type: ignore[attr-defined]
    assert driver.law.speed == mechanism.drivers[0].law.speed  # type: ignore[attr-defined]
    assert mechanism.with_parameters({"crank.start": 0.25}) == mechanism
    with pytest.raises(RequestError, match=r"^crank\.speed follows from 'turn'; set the parameters in it$"):
        mechanism.with_parameters({"crank.speed": 1.0})
    with pytest.raises(RequestError, match=r"^crank\.start = '2 mm': unit 'mm' must be one of rad, deg, rev"):
        mechanism.with_parameters({"crank.start": "2 mm"})


def test_a_table_of_a_parameter_is_checked() -> None:
    def message(line: str) -> str:
        with pytest.raises(MechanismError) as caught:
            parse(f'name = "a"\n[bodies.bar]\n[parameters]\n{line}\n', "a.toml")
        return str(caught.value).removeprefix("a.toml: ")

    assert message("a = { vale = 1 }") == (
        "[parameters.a] vale: unknown key; did you mean 'value'?; keys: value, description"
    )
    assert message('a = { description = "x" }') == "[parameters.a] needs the key 'value'; keys: value, description"
    assert message("a = { value = 1, description = 2 }") == "[parameters.a] description = 2 must be text"
    assert message("a = [1]") == "[parameters] a = [1] must be a number or text such as '2*a'"
    assert message("a = 1979-05-27") == ("[parameters] a = 1979-05-27 must be a number or text such as '2*a'")
