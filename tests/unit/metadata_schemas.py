"""What the published schemas of component metadata demand, restated: fields, their types, and what must not be missing.

Sources: mavlink/mavlink `component_metadata/{general,parameter,actuators}.schema.json` and mavlink/libevents
`validation/schema.json`, read in November 2026. As in those, a field that is not listed is an error.
"""

from typing import Any

Schema = dict[str, Any]
TEXT: Schema = {"type": "string"}
WHOLE: Schema = {"type": "integer"}
NUMBER: Schema = {"type": "number"}
TRUTH: Schema = {"type": "boolean"}


def record(required: dict[str, Schema], optional: dict[str, Schema] | None = None) -> Schema:
    """An object with these fields and no other."""
    fields = {**required, **(optional or {})}
    return {"type": "object", "properties": fields, "required": list(required), "additionalProperties": False}


def array(items: Schema) -> Schema:
    return {"type": "array", "items": items}


def by_key(pattern: str, items: Schema) -> Schema:
    return {"type": "object", "patternProperties": {pattern: items}, "additionalProperties": False}


def matching(pattern: str) -> Schema:
    return {"type": "string", "pattern": pattern}


VERSION_NUMBER = matching(r"^\d+\.\d+\.\d+(\.\d+)?$")
GENERAL = record(
    {
        "version": {"type": "integer", "minimum": 1},
        "metadataTypes": array(
            record(
                {"type": WHOLE, "uri": TEXT},
                {
                    "fileCrc": WHOLE,
                    "uriFallback": TEXT,
                    "fileCrcFallback": WHOLE,
                    "translationUri": TEXT,
                    "translationUriFallback": TEXT,
                },
            )
        ),
    },
    {"vendorName": TEXT, "modelName": TEXT, "firmwareVersion": VERSION_NUMBER, "hardwareVersion": VERSION_NUMBER},
)

PARAMETER_NAME = matching(r"^[\.\-a-zA-Z0-9_\{\}]{1,16}$")
PARAMETER = record(
    {
        "version": {"const": 1},  # the schema of 2026 wants 3, which QGroundControl refuses
        "parameters": array(
            record(
                {"name": PARAMETER_NAME},
                {
                    "type": {"enum": ["Uint8", "Int8", "Uint16", "Int16", "Uint32", "Int32", "Float"]},
                    "shortDesc": TEXT,
                    "longDesc": TEXT,
                    "units": TEXT,
                    "default": NUMBER,
                    "decimalPlaces": {"type": "integer", "minimum": 0},
                    "min": NUMBER,
                    "max": NUMBER,
                    "increment": NUMBER,
                    "rebootRequired": TRUTH,
                    "group": TEXT,
                    "category": TEXT,
                    "volatile": TRUTH,
                    "readOnly": TRUTH,
                    "values": array({"properties": {"value": NUMBER, "description": TEXT}}),
                    "bitmask": array({"properties": {"index": WHOLE, "description": TEXT}}),
                },
            )
        ),
    },
    {"translation": {"type": "object"}},
)

BASE_TYPES = [f"{sign}int{bits}_t" for sign in ("u", "") for bits in (8, 16, 32, 64)]
ENUM = record(
    {"type": {"enum": BASE_TYPES}},
    {
        "description": TEXT,
        "is_bitfield": TRUTH,
        "separator": TEXT,
        "entries": by_key(
            "^[0-9]+$",
            record(
                {"name": matching("^[a-z][a-z0-9_]*$"), "description": matching("^[^\n]*$")},
                {"comment": TEXT},
            ),
        ),
    },
)
EVENT = record(
    {"name": matching("^[a-zA-Z][a-zA-Z0-9_]*$"), "message": matching("^[^\n]{1,120}$")},
    {
        "description": TEXT,
        "type": {"enum": ["summary", "append_health_and_arming_messages"]},
        "instance_arg_index": WHOLE,
        "arguments": array(record({"name": matching("^[a-zA-Z][a-zA-Z0-9_]*$"), "type": TEXT}, {"description": TEXT})),
    },
)
EVENTS = record(
    {
        "version": {"const": 2},
        "components": by_key(
            "^[0-9]+$",
            record(
                {"namespace": matching("^[a-z][a-z0-9_]*$")},
                {
                    "enums": by_key("^[a-zA-Z][a-zA-Z0-9_]*_t$", ENUM),
                    "event_groups": by_key("^[a-z][a-z0-9_]*$", record({}, {"events": by_key("^[0-9]+$", EVENT)})),
                    "supported_protocols": array({"enum": ["calibration", "health_and_arming_check"]}),
                    "navigation_mode_groups": record({"groups": by_key("^[0-9]+$", array(WHOLE))}),
                },
            ),
        ),
    },
    {"translation": {"type": "object"}},
)

CONDITION = matching(r"^(true|false|[\.\-a-zA-Z0-9_]{1,16}(>|>=|==|!=|<|<=)\-?\d+)$")
UNIT_RANGE: Schema = {"type": "number", "minimum": -1, "maximum": 1}
TESTED = record(
    {"min": UNIT_RANGE, "max": UNIT_RANGE}, {"default": UNIT_RANGE, "default-is-nan": TRUTH, "reversible": TRUTH}
)
SEMANTICS = {
    "enum": [
        *(f"{what}{axis}" for what in ("pos", "axis") for axis in "xyz"),
        *("spin-dir", "type", "reversible", "disarmed", "min", "max", "failsafe", "function"),
    ]
}
PER_ITEM: dict[str, Schema] = {
    "name": TEXT,
    "value": array(NUMBER),
    "function": SEMANTICS,
    "index-offset": WHOLE,
    "show-as": TEXT,
    "advanced": TRUTH,
    "show-if": CONDITION,
    "identifier": TEXT,
}
LABELLED = record({"label": TEXT, "name": TEXT}, {key: value for key, value in PER_ITEM.items() if key != "name"})
CHANNEL = record({"label": TEXT, "param-index": WHOLE})
GROUP = record(
    {"group-label": TEXT, "count": {"type": ["string", "integer"]}, "actuator-type": TEXT},
    {
        "per-item-parameters": array(record({"label": TEXT}, PER_ITEM)),
        "item-label-prefix": {"type": ["string", "array"], "items": TEXT},
        "required": TRUTH,
        "parameters": array(record({"label": TEXT, "name": TEXT}, {"advanced": TRUTH})),
    },
)
ACTUATOR_TYPE = record(
    {"values": TESTED, "function-min": WHOLE, "function-max": WHOLE},
    {"label-index-offset": WHOLE, "per-item-parameters": array(LABELLED)},
)
ACTUATORS = record(
    {
        "version": {"type": "integer", "minimum": 2},
        "outputs_v1": array(
            record(
                {
                    "label": TEXT,
                    "subgroups": array(
                        record({"per-channel-parameters": array(LABELLED), "channels": array(CHANNEL)}, {"label": TEXT})
                    ),
                },
                {"show-subgroups-if": CONDITION},
            )
        ),
        "functions_v1": by_key(r"^\d+$", record({"label": TEXT}, {"exclude-from-actuator-testing": TRUTH})),
        "mixer_v1": record(
            {
                "actuator-types": {
                    "type": "object",
                    "properties": {"DEFAULT": record({"values": TESTED})},
                    "patternProperties": {"^((?!DEFAULT).)*$": ACTUATOR_TYPE},
                    "required": ["DEFAULT"],
                },
                "config": array(
                    record(
                        {"actuators": array(GROUP)},
                        {"option": CONDITION, "type": {"const": "multirotor"}, "title": TEXT, "help-url": TEXT},
                    )
                ),
            }
        ),
    },
    {"translation": {"type": "object"}, "show-ui-if": CONDITION},
)
