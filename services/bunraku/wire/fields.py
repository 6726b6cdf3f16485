"""Types of the fields of messages (proto/messages.md): their bounds, and what the generated documents say of them."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field, WithJsonSchema

from bunraku.wire.limbs import MAX_LIMBS, MAX_PERFORMERS
from bunraku.wire.prop import MAX_PROPS

Text = Annotated[str, Field(strict=True)]
Flag = Annotated[bool, Field(strict=True)]
SafeInteger = Annotated[int, Field(strict=True, ge=0, lt=1 << 53)]
"""A count or a time that a JavaScript number represents exactly."""
ClockTime = Annotated[SafeInteger, Field(description="Clock time in microseconds.")]
MotionTime = Annotated[SafeInteger, Field(description="Motion time in microseconds.")]
Duration = Annotated[SafeInteger, Field(description="Duration in microseconds.")]
MotionId = Annotated[Text, Field(description="Id of the motion.")]
LimbNumber = Annotated[
    int, Field(strict=True, ge=0, lt=MAX_LIMBS, description="Limb l of performer k has number 4 k + l.")
]
HandPair = Annotated[
    list[LimbNumber], Field(min_length=2, max_length=2, description="Numbers of two hands, in any order.")
]
LimbEpoch = Annotated[SafeInteger, Field(description="Epoch of the grant.")]
Tracks = Annotated[
    list[dict[str, Any]],
    WithJsonSchema(
        {
            "type": "array",
            "items": {
                "title": "Track",
                "type": "object",
                "properties": {"type": {"type": "string"}},
                "required": ["type"],
            },
            "description": "One map per track (proto/messages.md, 3.2).",
        }
    ),
]
PuppeteerEntries = Annotated[
    list[dict[str, Any]],
    WithJsonSchema(
        {
            "type": "array",
            "items": {
                "title": "PuppeteerPresence",
                "type": "object",
                "properties": {
                    "id": {"type": "string"},
                    "name": {"type": "string"},
                    "colour": {"type": "integer", "minimum": 0, "maximum": 4},
                },
                "required": ["id", "name", "colour"],
            },
            "description": "Puppeteers in the order of joining.",
        }
    ),
]
LiveEntries = Annotated[
    list[dict[str, Any]],
    WithJsonSchema(
        {
            "type": "array",
            "items": {
                "title": "LivePresence",
                "type": "object",
                "properties": {
                    "performer": {"type": "integer", "minimum": 0, "maximum": MAX_PERFORMERS - 1},
                    "id": {"type": "string"},
                    "name": {"type": "string"},
                },
                "required": ["performer", "id", "name"],
            },
            "minItems": 1,
        }
    ),
]
CrowdEntries = Annotated[
    list[dict[str, Any]],
    WithJsonSchema(
        {
            "type": "array",
            "items": {
                "title": "CrowdPresence",
                "type": "object",
                "properties": {
                    "limb": {"type": "integer", "minimum": 0, "maximum": MAX_LIMBS - 1},
                    "policy": {"type": "string"},
                    "pulls": {"type": "integer", "minimum": 0},
                },
                "required": ["limb", "policy", "pulls"],
            },
            "minItems": 1,
        }
    ),
]
FiniteNumber = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Place = Annotated[
    list[FiniteNumber],
    Field(min_length=3, max_length=3, description="Target of a limb, as the values of an Input of kind 1."),
]

PropNumber = Annotated[int, Field(strict=True, ge=0, lt=MAX_PROPS, description="Number of the prop.")]
PropPlace = Annotated[
    list[FiniteNumber],
    Field(
        min_length=3,
        max_length=3,
        description="Where it lies: x and z, metres, and turn about y from z towards x, radians; stage frame.",
    ),
]
PropEntries = Annotated[
    list[dict[str, Any]],
    WithJsonSchema(
        {
            "type": "array",
            "items": {
                "title": "PropPresence",
                "type": "object",
                "properties": {
                    "prop": {"type": "integer", "minimum": 0, "maximum": MAX_PROPS - 1},
                    "kind": {"type": "string"},
                    "limb": {"anyOf": [{"type": "integer", "minimum": 0, "maximum": MAX_LIMBS - 1}, {"type": "null"}]},
                    "place": {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3},
                },
                "required": ["prop", "kind", "limb", "place"],
            },
            "minItems": 1,
        }
    ),
]
