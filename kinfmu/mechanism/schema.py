"""The JSON Schema of mechanism files, by which editors complete keys, from the declared keys (`declared.py`).

A schema describes names and shapes of keys; only `kinfmu check` can check references and units.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from typing import Any

from kinfmu.mechanism.body import GROUND_NAME, MEASURED_OVER, Body, Gravity, RunSettings, Start
from kinfmu.mechanism.declared import REQUIRED, Key, keys_of, summary_of
from kinfmu.mechanism.drivers import DRIVERS
from kinfmu.mechanism.expression import LONGEST
from kinfmu.mechanism.joints import JOINTS
from kinfmu.mechanism.laws import LAWS, RISES, External, Law, LawQuantity, Spline
from kinfmu.mechanism.laws.sequence import DWELL
from kinfmu.mechanism.loads import LOADS
from kinfmu.mechanism.measures import READINGS
from kinfmu.mechanism.number import EXAMPLES
from kinfmu.mechanism.quantities import POSE_QUANTITIES
from kinfmu.mechanism.quantities.placement import Reference
from kinfmu.mechanism.repeats import LARGEST_COUNT, REPEATED
from kinfmu.mechanism.toml_document import table_keys
from kinfmu.mechanism.valid import MOST_PARTS
from kinfmu.units import METRES, Quantity

Schema = dict[str, Any]
DIALECT = "http://json-schema.org/draft-07/schema#"  # the newest that editors of TOML agree on
_PART = "[A-Za-z_][A-Za-z0-9_]{0,99}"
NAME = f"^{_PART}$"
_BRACED = r"(?:[A-Za-z_]|\{[A-Za-z0-9_+\- ]+\})(?:[A-Za-z0-9_]|\{[A-Za-z0-9_+\- ]+\})*"  # with numbers of repeats
_REFERRED = {"point": "point", "body": "braced_name", "coordinate": "point"}  # definitions by what is referred to


def schema_text() -> str:
    """Return the schema as JSON; the same bytes every time."""
    return json.dumps(schema(), indent=2, ensure_ascii=False) + "\n"


def schema() -> Schema:
    """Return the schema of a mechanism file, as a tree of JSON values."""
    counts = {"type": "integer", "minimum": 0, "maximum": LARGEST_COUNT}
    tables = {
        "name": _ref("name", description="The mechanism's name, and its FMU's"),
        "title": {"type": "string", "description": "One line for people"},
        "units": _table({"length": {"enum": [*METRES, "inch"], "description": "Unit of bare lengths; default: m"}}),
        "parameters": _named(_ref("parameter"), "Numbers that expressions refer to by name", "parameter_name"),
        "run": _table(
            {
                **_without_defaults(RunSettings),
                "over": {
                    "enum": list(MEASURED_OVER),
                    "description": "Motion of which check reports measures and forces; default: a turn of a single "
                    "driver that turns round at constant speed, else the run",
                },
            }
        ),
        "bodies": _named(_ref("body"), f"Bodies; '{GROUND_NAME}' does not move"),
        "joints": _named(_ref("joint"), "Joints between the bodies"),
        "drivers": _named(_ref("driver"), "What moves the mechanism"),
        "gravity": _table(_without_defaults(Gravity), required=Gravity._fields),
        "loads": _named(_ref("load"), "Forces and torques on the bodies"),
        "points": _named(_ref("point"), "Points of interest, as 'body.point'"),
        "measures": _named(_ref("reading"), "What `kinfmu check` reads off a motion, such as a stroke"),
        "outputs": _table(
            {
                "coordinates": {
                    "description": "Generalized coordinates in the results; default: 'moving'",
                    "anyOf": [{"enum": ["moving", "all"]}, {"type": "array", "items": {"type": "string"}}],
                }
            }
        ),
    }
    tables["counts"] = _named(counts, "Whole numbers that braces and repeats refer to by name")
    tables["repeat"] = _named(_repeat(tables), "Tables that are read once for each number of a range")
    return {
        "$schema": DIALECT,
        "title": "kinfmu mechanism",
        **_table(tables, required=("name", "bodies")),
        "definitions": _definitions(),
    }


def _repeat(named: Schema) -> Schema:
    """Describe the table of a repeat; named: the tables of named members."""
    whole = {"anyOf": [{"type": "integer", "minimum": 0, "maximum": LARGEST_COUNT}, {"type": "string"}]}
    names = {"propertyNames": _ref("braced_name")}
    return _table(
        {
            "from": {"description": "First number; default: 1", **whole},
            "to": {"description": "Last number, or a count such as 'stages - 1'", **whole},
            **{key: {**named[key], **names} for key in REPEATED},
        },
        required=("to",),
    )


def _definitions() -> Schema:
    laws_of_joints = [law for law in LAWS if law is not External]
    return {
        "name": {"type": "string", "pattern": NAME},
        "parameter_name": {"type": "string", "pattern": rf"^{_PART}(?:\.{_PART}){{0,{MOST_PARTS - 1}}}$"},
        "braced_name": {"type": "string", "pattern": f"^{_BRACED}$"},
        "point": {"type": "string", "pattern": rf"^{_BRACED}\.{_BRACED}$"},
        "number": {
            "anyOf": [
                {"type": "number"},
                {"type": "string", "pattern": r"^[A-Za-z0-9_.,+\-*/() \t{}]+$", "maxLength": LONGEST},
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
        "measure": {"oneOf": [_member(cls, (), "measure") for cls in POSE_QUANTITIES]},
        "measured": {"anyOf": [_ref("point"), _ref("measure")]},
        "reading": {"oneOf": [_member(cls, ()) for cls in READINGS]},
        "joint": {"oneOf": [_member(cls, laws_of_joints) for cls in JOINTS]},
        "driver": {"oneOf": [_member(cls, LAWS) for cls in DRIVERS]},
        "load": {"oneOf": [_member(cls, LAWS) for cls in LOADS]},
    }


def _body() -> Schema:
    return _table(
        {
            "points": {
                "type": "object",
                "description": "Points [x, y] in the body's own frame",
                "propertyNames": _ref("braced_name"),
                "additionalProperties": _ref("xy"),
            },
            "start": {
                "description": "A rough pose from which assembly starts",
                **_table(_without_defaults(Start)),
            },
            **_without_defaults(Body),
        }
    )


def _without_defaults(cls: Any) -> Schema:
    """Describe the keys of a class, whose meanings state the defaults."""
    return {key.name: _value(key._replace(default=REQUIRED)) for key in keys_of(cls)}


def _segment() -> Schema:
    """Describe a rise or a dwell of a sequence."""
    return {
        "oneOf": [
            _table(
                {
                    "law": {"enum": [rise.type for rise in RISES]},
                    "rise": _number(LawQuantity("led"), "Change of u, negative for a fall"),
                    "duration": _number(LawQuantity("argument"), "Range of x"),
                },
                required=("law", "rise", "duration"),
            ),
            _table(
                {"law": {"const": DWELL}, "duration": _number(LawQuantity("argument"), "Range of x")},
                required=("law", "duration"),
            ),
        ]
    }


def _own_keys(cls: Any, word: str) -> tuple[Schema, list[str]]:
    """Return the keys of a class without `law`, after `word` with its type, and the names of the required ones."""
    keys = [key for key in keys_of(cls) if key.takes != "law"]
    own = {word: {"const": cls.type}, **{key.name: _value(key) for key in keys}}
    return own, [word, *(key.name for key in keys if key.default is REQUIRED)]


def _member(cls: Any, laws: Iterable[type[Law]], word: str = "type") -> Schema:
    """Describe the table of a joint, driver or measure, with the keys of its law if it has one."""
    own, required = _own_keys(cls, word)
    if all(key.takes != "law" for key in keys_of(cls)):
        return {"description": summary_of(cls), **_table(own, required)}
    return {
        "description": summary_of(cls),
        "type": "object",
        "properties": own,
        "required": [*required, "law"],
        "oneOf": [_ref(f"law_{law.type}", propertyNames={"enum": [*own, "law", *table_keys(law)]}) for law in laws],
    }


def _law(law: type[Law]) -> Schema:
    """Describe the keys of a law, which belong to the table of the joint or driver."""
    properties, required = _own_keys(law, "law")
    found: Schema = {"description": summary_of(law), "type": "object", "properties": properties, "required": required}
    if law is Spline:
        properties["file"] = {"type": "string", "description": "A CSV file of two columns, instead of points"}
        found["required"] = [key for key in required if key != "points"]
        found["oneOf"] = [{"required": ["points"]}, {"required": ["file"]}]
    return found


def _value(key: Key) -> Schema:
    """Describe the values that a key accepts."""
    if key.takes == "number" and key.measures is not None:
        return _number(key.measures, key.meaning, key.default)
    shapes: dict[str, Schema] = {
        "text": _text(key.refers),
        "pair": _list(_text(key.refers), 2, 2),
        "truth": {"type": "boolean"},
        "numbers": _list(_ref("number"), 1),
        "place": _ref("xy"),
        "points": _list(_ref("xy"), 2),
        "ends": _list(_ref("name"), 2, 2),
        "corners": _list(_ref("name"), 3),
        "segments": _list(_ref("segment"), 1),
        "measure": _ref("measure"),
        "measured": _ref("measured"),
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
    more = {"examples": ["z_1/z_2" if kind == "number" else EXAMPLES[kind]]} if kind else {}
    return _ref("number", description=meaning, **more, **({} if default is REQUIRED else {"default": default}))


def _ref(definition: str, **more: Any) -> Schema:
    """Refer to a definition, with `more` keywords; this dialect ignores all keywords next to a $ref."""
    ref = {"$ref": f"#/definitions/{definition}"}
    return {**more, "allOf": [ref]} if more else ref


def _list(items: Schema, least: int, most: int | None = None) -> Schema:
    return {"type": "array", "items": items, "minItems": least, **({} if most is None else {"maxItems": most})}


def _named(member: Schema, description: str, name: str = "name") -> Schema:
    """Describe a table of named members; name: what their names match."""
    names = {"propertyNames": _ref(name)}
    return {"type": "object", "description": description, "additionalProperties": member, **names}


def _table(properties: Schema, required: Iterable[str] = ()) -> Schema:
    needed = list(required)
    found: Schema = {"type": "object", "properties": properties, "additionalProperties": False}
    return {**found, "required": needed} if needed else found
