"""The JSON Schema of mechanism files, from what joints, drivers and laws declare: editors complete keys by it.

A schema knows shapes and names of keys; what refers to what, and units, only `kinfmu check` can judge.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from typing import Any

from kinfmu.drivers import DRIVERS
from kinfmu.joints import JOINTS
from kinfmu.laws import LAWS, RISES, External, Law, LawQuantity, Spline
from kinfmu.laws.sequence import DWELL
from kinfmu.measures import MEASURES, Measure
from kinfmu.measures.placement import Reference
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.declared import REQUIRED, Key, keys_of, summary_of
from kinfmu.mechanism.expression import LONGEST
from kinfmu.units import METRES, Quantity

Schema = dict[str, Any]
DIALECT = "http://json-schema.org/draft-07/schema#"  # the newest that editors of TOML agree on
NAME = "^[A-Za-z_][A-Za-z0-9_]{0,99}$"
_REFERRED = {"point": "point", "body": "name"}  # definitions by what a reference refers to
_EXAMPLES = {"length": "25 mm", "angle": "60 deg", "time": "10 ms", "number": "z_1/z_2"}


def schema_text() -> str:
    """The schema as JSON; the same bytes every time."""
    return json.dumps(schema(), indent=2, ensure_ascii=False) + "\n"


def schema() -> Schema:
    """The schema of a mechanism file, as a tree of JSON values."""
    names = {"propertyNames": _ref("name")}
    tables = {
        "name": _ref("name", description="The mechanism's name, and its FMU's"),
        "title": {"type": "string", "description": "One line for people"},
        "units": _table(
            {"length": {"enum": list(METRES), "description": "Unit of bare lengths; m if nothing is said"}}
        ),
        "parameters": {
            "type": "object",
            "description": "Numbers that expressions refer to by name",
            "additionalProperties": _ref("parameter"),
            **names,
        },
        "run": _table(
            {
                "start": _number(Quantity("time"), "First sample [s]; 0 if nothing is said"),
                "stop": _number(Quantity("time"), "Last sample [s]; 1 if nothing is said"),
                "step": _number(Quantity("time"), "Communication step [s]; 0.01 if nothing is said"),
            }
        ),
        "bodies": _named("body", f"Bodies; '{GROUND_NAME}' does not move", **names),
        "joints": _named("joint", "Joints between the bodies", **names),
        "drivers": _named("driver", "What moves the mechanism", **names),
        "points": {
            "type": "object",
            "description": "Points of interest, as 'body.point'",
            "additionalProperties": _ref("point"),
            **names,
        },
        "outputs": _table(
            {
                "coordinates": {
                    "description": "Generalized coordinates to hand out; 'moving' if nothing is said",
                    "anyOf": [{"enum": ["moving", "all"]}, {"type": "array", "items": {"type": "string"}}],
                }
            }
        ),
    }
    return {
        "$schema": DIALECT,
        "title": "kinfmu mechanism",
        **_table(tables, required=("name", "bodies")),
        "definitions": _definitions(),
    }


def _definitions() -> Schema:
    laws_of_joints = [law for law in LAWS if law is not External]
    return {
        "name": {"type": "string", "pattern": NAME},
        "point": {"type": "string", "pattern": r"^[A-Za-z_][A-Za-z0-9_]*\.[A-Za-z_][A-Za-z0-9_]*$"},
        "number": {
            "anyOf": [
                {"type": "number"},
                {"type": "string", "pattern": r"^[A-Za-z0-9_.,+\-*/() \t]+$", "maxLength": LONGEST},
            ]
        },
        "parameter": {
            "anyOf": [
                _ref("number"),
                _table({"value": _ref("number"), "description": {"type": "string"}}, required=("value",)),
            ]
        },
        "xy": _list(_ref("number"), 2, 2),
        "body": _body(),
        "segment": _segment(),
        **{f"law_{law.type}": _law(law) for law in LAWS},
        "measure": {"oneOf": [_measure(cls) for cls in MEASURES]},
        "joint": {"oneOf": [_member(cls, laws_of_joints) for cls in JOINTS]},
        "driver": {"oneOf": [_member(cls, LAWS) for cls in DRIVERS]},
    }


def _body() -> Schema:
    return _table(
        {
            "points": {
                "type": "object",
                "description": "Points [x, y] in the body's own frame",
                "propertyNames": _ref("name"),
                "additionalProperties": _ref("xy"),
            },
            "start": {
                "description": "A rough pose from which assembly starts",
                **_table(
                    {
                        "x": _number(Quantity("length"), "Of the frame's origin, in the world"),
                        "y": _number(Quantity("length"), "Of the frame's origin, in the world"),
                        "phi": _number(Quantity("angle"), "Angle of the frame; bare numbers are radians"),
                    }
                ),
            },
        }
    )


def _segment() -> Schema:
    """A rise or a dwell of a sequence."""
    return {
        "oneOf": [
            _table(
                {
                    "law": {"enum": [rise.type for rise in RISES]},
                    "rise": _number(LawQuantity("led"), "How far, down if negative"),
                    "duration": _number(LawQuantity("argument"), "How long"),
                },
                required=("law", "rise", "duration"),
            ),
            _table(
                {"law": {"const": DWELL}, "duration": _number(LawQuantity("argument"), "How long")},
                required=("law", "duration"),
            ),
        ]
    }


def _member(cls: Any, laws: Iterable[type[Law]]) -> Schema:
    """The table of a joint or driver; one that has a law holds the law's keys too."""
    keys = [key for key in keys_of(cls) if key.takes != "law"]
    own = {"type": {"const": cls.type}, **{key.name: _value(key) for key in keys}}
    required = ["type", *(key.name for key in keys if key.default is REQUIRED)]
    if len(keys) == len(keys_of(cls)):
        return {"description": summary_of(cls), **_table(own, required)}
    return {
        "description": summary_of(cls),
        "type": "object",
        "properties": own,
        "required": [*required, "law"],
        "oneOf": [_ref(f"law_{law.type}", propertyNames={"enum": [*own, "law", *_law_keys(law)]}) for law in laws],
    }


def _measure(cls: type[Measure]) -> Schema:
    """The table of a measured quantity."""
    keys = keys_of(cls)
    required = ["measure", *(key.name for key in keys if key.default is REQUIRED)]
    own = {"measure": {"const": cls.type}, **{key.name: _value(key) for key in keys}}
    return {"description": summary_of(cls), **_table(own, required)}


def _law_keys(law: type[Law]) -> list[str]:
    return [key.name for key in keys_of(law)] + (["file"] if law is Spline else [])


def _law(law: type[Law]) -> Schema:
    """The keys of a law, which stand in the table of what it leads."""
    keys = keys_of(law)
    properties = {"law": {"const": law.type}, **{key.name: _value(key) for key in keys}}
    required = ["law", *(key.name for key in keys if key.default is REQUIRED)]
    found: Schema = {"description": summary_of(law), "type": "object", "properties": properties, "required": required}
    if law is Spline:
        properties["file"] = {"type": "string", "description": "A CSV file of two columns, in place of points"}
        found["required"] = [key for key in required if key != "points"]
        found["oneOf"] = [{"required": ["points"]}, {"required": ["file"]}]
    return found


def _value(key: Key) -> Schema:
    """What may stand as the value of a key."""
    if key.takes == "number" and key.measures is not None:
        return _number(key.measures, key.meaning, key.default)
    shapes: dict[str, Schema] = {
        "text": _text(key.refers),
        "pair": _list(_text(key.refers), 2, 2),
        "truth": {"type": "boolean"},
        "numbers": _list(_ref("number"), 1),
        "points": _list(_ref("xy"), 2),
        "segments": _list(_ref("segment"), 1),
        "measure": _ref("measure"),
    }
    default = {} if key.default in (REQUIRED, None) else {"default": key.default}
    shape = shapes[key.takes]
    return {"description": key.meaning, **({"allOf": [shape]} if "$ref" in shape else shape), **default}


def _text(refers: Reference | None) -> Schema:
    if refers is None:
        return {"type": "string"}
    return {"enum": list(refers.choices)} if refers.kind == "choice" else _ref(_REFERRED[refers.kind])


def _number(measures: Quantity | LawQuantity, meaning: str, default: Any = REQUIRED) -> Schema:
    kind = measures.kind if isinstance(measures, Quantity) and not measures.order else ""
    more = {"examples": [_EXAMPLES[kind]]} if kind else {}
    return _ref("number", description=meaning, **more, **({} if default is REQUIRED else {"default": default}))


def _ref(definition: str, **more: Any) -> Schema:
    """A definition, with what stands beside it; in this dialect nothing beside a $ref is seen."""
    ref = {"$ref": f"#/definitions/{definition}"}
    return {**more, "allOf": [ref]} if more else ref


def _list(items: Schema, least: int, most: int | None = None) -> Schema:
    return {"type": "array", "items": items, "minItems": least, **({} if most is None else {"maxItems": most})}


def _named(definition: str, description: str, **more: Any) -> Schema:
    """A table of tables that have names of their own."""
    return {
        "type": "object",
        "description": description,
        "additionalProperties": _ref(definition),
        **more,
    }


def _table(properties: Schema, required: Iterable[str] = ()) -> Schema:
    needed = list(required)
    return {
        "type": "object",
        "properties": properties,
        "additionalProperties": False,
        **({"required": needed} if needed else {}),
    }
