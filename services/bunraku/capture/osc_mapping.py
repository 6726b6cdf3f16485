"""Mapping files for OSC senders without a standard: which address holds which joint, in which form.

A mapping is TOML or JSON:

    version = 1
    space = "world"                        # rotations and positions: "world" or "parent"
    [[map]]
    address = "/skeleton/{joint}/rotation" # {joint} stands for the sender's name of a joint
    kind = "rotation"                      # rotation, position, blendshape, time or frame_end
    names = { arm_l = "LeftUpperArm" }     # sender's names: bones of Unity's humanoid, or H-Anim joints
    order = "xyzw"                         # xyzw, wxyz, or Euler angles about rotated axes, such as zxy
    unit = "degrees"                       # of Euler angles degrees or radians; of positions m, cm or mm
    axes = "-x y z"                        # sender's axes that point left, up and forwards
    first_argument = 0

An address without {joint} has a `joint` instead of `names`. Rotations are relative to the T-pose.
"""

from __future__ import annotations

import json
import re
import tomllib
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from bunraku.capture.errors import UnreadableCapture, quote_excerpt
from bunraku.capture.humanoid import BONE_BY_LOWER_NAME, ROOT_NAME
from bunraku.motion.humanoid import BONE_JOINTS

MAX_MAPPING_BYTES = 1 << 16
MAX_ENTRIES = 256
JOINT_PLACEHOLDER = "{joint}"
METRES_PER_UNIT = {"m": 1.0, "cm": 0.01, "mm": 0.001}

_JOINTS: dict[str, str] = (
    {joint: bone for bone, joint in BONE_JOINTS.items()} | BONE_BY_LOWER_NAME | {ROOT_NAME.lower(): ROOT_NAME}
)
_EULER_ORDERS = ("xyz", "xzy", "yxz", "yzx", "zxy", "zyx")
_QUATERNION_ORDERS = ("xyzw", "wxyz")
_LINE = re.compile(r"\(at line (\d+), column \d+\)")

Address = Annotated[str, Field(pattern=r"^/[^\s#*,?\[\]]*$", max_length=200)]


class MappingEntry(BaseModel):
    """Meaning of one address; see the module."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)

    address: Address
    kind: Literal["rotation", "position", "blendshape", "time", "frame_end"]
    joint: str | None = None
    names: dict[str, str] = Field(default_factory=dict, max_length=MAX_ENTRIES)
    order: str | None = None
    unit: Literal["degrees", "radians", "m", "cm", "mm"] | None = None
    axes: str = "x y z"
    first_argument: int = Field(default=0, ge=0, le=60)

    @model_validator(mode="after")
    def _check_combination(self) -> Self:
        placeholders = self.address.count(JOINT_PLACEHOLDER)
        if placeholders > 1:
            raise ValueError(f"address has {JOINT_PLACEHOLDER} more than once")
        named = self.kind in ("rotation", "position", "blendshape")
        if named and placeholders == (self.joint is not None):
            raise ValueError(f"give either a joint or {JOINT_PLACEHOLDER} in the address")
        if not named and (placeholders or self.joint is not None):
            raise ValueError(f"a {self.kind} belongs to no joint")
        if self.kind in ("rotation", "position"):
            for name in [*self.names.values(), *([self.joint] if self.joint is not None else [])]:
                if find_bone(name) is None:
                    raise ValueError(f"{quote_excerpt(name)} is neither a bone of Unity's humanoid nor an H-Anim joint")
        orders = {"rotation": (*_QUATERNION_ORDERS, *_EULER_ORDERS), "position": ("xyz",)}.get(self.kind, ())
        if self.order is not None and self.order not in orders:
            raise ValueError(f"order of a {self.kind} is one of {', '.join(orders) or 'none'}")
        units = (
            ("degrees", "radians")
            if self.kind == "rotation" and self.order in _EULER_ORDERS
            else tuple(METRES_PER_UNIT)
            if self.kind == "position"
            else ()
        )
        if self.unit is not None and self.unit not in units:
            raise ValueError(f"unit of this {self.kind} is one of {', '.join(units) or 'none'}")
        parse_axes(self.axes)
        return self


class _MappingFile(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)

    version: Literal[1]
    space: Literal["world", "parent"]
    map: list[MappingEntry] = Field(min_length=1, max_length=MAX_ENTRIES)


@dataclass(frozen=True, slots=True)
class OscMapping:
    """Valid mapping: the space of the transforms, and what the addresses mean."""

    in_world: bool
    entries: tuple[MappingEntry, ...]


def parse_mapping(data: bytes) -> OscMapping:
    """Parse a mapping file; raise `UnreadableCapture` with the line of a syntax error or the field of another."""
    if len(data) > MAX_MAPPING_BYTES:
        raise UnreadableCapture("Mapping too large", f"it has {len(data)} bytes, expected at most {MAX_MAPPING_BYTES}")
    try:
        file = _MappingFile.model_validate(_parse_syntax(data))
    except ValidationError as error:
        first = error.errors(include_url=False, include_context=False)[0]
        raise UnreadableCapture(
            "Invalid mapping",
            quote_excerpt(first["msg"], 200),
            field=".".join(str(part)[:40] for part in first["loc"][:6]) or None,
            hint="entries count from 0",
        ) from error
    return OscMapping(file.space == "world", tuple(file.map))


def _parse_syntax(data: bytes) -> Any:
    try:
        text = data.decode("utf-8-sig").replace("\r\n", "\n")
        return json.loads(text) if text.lstrip().startswith("{") else tomllib.loads(text)
    except json.JSONDecodeError as error:
        raise UnreadableCapture("Invalid JSON", error.msg, line=error.lineno) from error
    except UnicodeDecodeError as error:
        raise UnreadableCapture("Invalid mapping", "the file is not UTF-8", hint="save it as UTF-8") from error
    except RecursionError as error:
        raise UnreadableCapture("Invalid mapping", "values are nested too deep") from error
    except ValueError as error:
        place = _LINE.search(str(error))
        raise UnreadableCapture(
            "Invalid TOML", quote_excerpt(str(error), 200), line=int(place[1]) if place else None
        ) from error


def find_bone(name: str) -> str | None:
    """Return the bone that `name` means: a bone of Unity's humanoid in any case, "Root", or an H-Anim joint."""
    return _JOINTS.get(name.lower())


@lru_cache(maxsize=64)
def parse_axes(axes: str) -> tuple[tuple[int, float], ...]:
    """Return index and sign of the sender's axis for left, up and forwards; raise ValueError if invalid."""
    found = [("xyz".find(word[-1:]), -1.0 if word[0] == "-" else 1.0) for word in axes.split()]
    if sorted(index for index, _ in found) != [0, 1, 2] or not re.fullmatch(r"\s*(?:[+-]?[xyz]\s*){3}", axes):
        raise ValueError(f"axes are three signed letters such as '-x y z', not {quote_excerpt(axes)}")
    return tuple(found)
