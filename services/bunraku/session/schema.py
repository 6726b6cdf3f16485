"""Request bodies of the sessions API."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated

import numpy as np
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, FiniteFloat, field_validator

from bunraku.http.problem_details import invalid_field_problem
from bunraku.marionette.crowd.policy import CrowdPolicy
from bunraku.marionette.limb_rig import ArmRig, Limb
from bunraku.marionette.proportions import ProportionsError
from bunraku.motion.placement import Placement
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_COUNT, JOINTS, TIP_JOINTS, Figure
from bunraku.runtime.problem import ProblemError
from bunraku.wire.limbs import LIMBS, MAX_LIMBS
from bunraku.wire.prop import MAX_PROPS, STORED_PROP_PATTERN, PropKind, is_stored_prop

MAX_BONE_M = 3.0
"""Longest part of an offset or tip along one axis."""


_LIMB_NUMBERS = {name: number for number, name in enumerate(LIMBS)} | {str(n): n for n in range(MAX_LIMBS)}
"""Numbers of limbs by their keys: names of the first performer's, and numbers in decimal."""
_PROP_NUMBERS = {str(number): number for number in range(MAX_PROPS)}


def _check_limb(key: str) -> str:
    if key not in _LIMB_NUMBERS:
        raise ValueError(f"there is no limb {key[:40]!r}: limbs are {', '.join(LIMBS)} and 0 to {MAX_LIMBS - 1}")
    return key


def _check_prop(key: str) -> str:
    if key not in _PROP_NUMBERS:
        raise ValueError(f"there is no prop {key[:40]!r}: props are 0 to {MAX_PROPS - 1}")
    return key


def _check_kind(kind: str) -> str:
    if kind not in tuple(PropKind) and not is_stored_prop(kind):
        raise ValueError(f"there is no kind {kind[:40]!r}: it is {', '.join(PropKind)}, or the id of a stored prop")
    return kind


LimbKey = Annotated[
    str,
    AfterValidator(_check_limb),
    Field(json_schema_extra={"pattern": rf"^({'|'.join(LIMBS)}|[0-9]|1[0-{MAX_LIMBS - 11}])$"}),
]
"""Name of a limb of the first performer, or number of a limb in decimal."""
PropKey = Annotated[str, AfterValidator(_check_prop), Field(json_schema_extra={"pattern": rf"^[0-{MAX_PROPS - 1}]$"})]
"""Number of a prop in decimal."""
Kind = Annotated[
    str,
    AfterValidator(_check_kind),
    Field(json_schema_extra={"pattern": rf"^({'|'.join(PropKind)}|{STORED_PROP_PATTERN})$"}),
]
"""Kind of a prop: a built-in one, or the id of a stored prop."""


class NewSession(BaseModel):
    """Session to open."""

    model_config = ConfigDict(extra="forbid")
    motion: Annotated[str, Field(max_length=64)]
    loop: bool = True
    playing: bool = True


class SessionEdit(BaseModel):
    """Edits of a session's timeline, its open limbs and its props; omitted fields stay unchanged."""

    model_config = ConfigDict(extra="forbid")
    playing: bool | None = None
    position: Annotated[int | None, Field(ge=0, lt=1 << 53, description="microseconds")] = None
    loop: bool | None = None
    motion: Annotated[str | None, Field(max_length=64)] = None
    crowd: Annotated[
        dict[LimbKey, CrowdPolicy | None],
        Field(
            max_length=MAX_LIMBS,
            description="merge policy of each limb to open to the crowd, by name of the limb or by number; "
            "null closes it",
        ),
    ] = {}
    props: Annotated[
        dict[PropKey, Kind | None],
        Field(
            max_length=MAX_PROPS,
            description="kind of each prop to bring on the stage, or id of a stored one, by number; null removes it",
        ),
    ] = {}

    @field_validator("crowd")
    @classmethod
    def _refuse_contradictions(cls, crowd: dict[str, CrowdPolicy | None]) -> dict[str, CrowdPolicy | None]:
        for name in crowd.keys() & set(LIMBS):
            if str(_LIMB_NUMBERS[name]) in crowd:
                raise ValueError(f"{name} and {_LIMB_NUMBERS[name]} are the same limb: leave one out")
        return crowd

    def open_limbs(self, before: Mapping[int, str]) -> dict[int, str]:
        """Return the policies of the open limbs after this edit, by number."""
        edits = {_LIMB_NUMBERS[key]: policy for key, policy in self.crowd.items()}
        changed = {**before, **{limb: policy and policy.value for limb, policy in edits.items()}}
        return {limb: policy for limb, policy in changed.items() if policy is not None}

    @property
    def stored_props(self) -> dict[str, str]:
        """Ids of the stored props that this edit brings, by key."""
        return {key: kind for key, kind in self.props.items() if kind is not None and is_stored_prop(kind)}

    def prop_kinds(self, before: Mapping[int, str]) -> dict[int, str]:
        """Return the kinds of the props after this edit, by number."""
        changed = {**before, **{_PROP_NUMBERS[key]: kind for key, kind in self.props.items()}}
        return {number: kind for number, kind in changed.items() if kind is not None}


Vector = Annotated[list[FiniteFloat], Field(min_length=3, max_length=3)]


class FigureLengths(BaseModel):
    """Limb lengths of a performer in H-Anim's I-pose, metres: right-handed, y up, facing z, x to the left."""

    model_config = ConfigDict(extra="forbid")
    offsets: Annotated[
        dict[str, Vector], Field(max_length=JOINT_COUNT, description="position of each joint from its parent, by name")
    ]
    tips: Annotated[
        dict[str, Vector],
        Field(max_length=len(TIP_JOINTS), description="tip of the hands, toes and head, from their joint, by name"),
    ]

    def to_figure(self) -> Figure:
        """Return the figure; raise `ProblemError` (422) with the invalid field."""
        offsets = self._table("offsets", self.offsets, JOINTS)
        tips = self._table("tips", self.tips, [JOINTS[joint] for joint in TIP_JOINTS])
        figure = Figure(offsets, tips)
        try:
            for limb in (Limb.LEFT_HAND, Limb.RIGHT_HAND):
                ArmRig(figure, limb)
        except ProportionsError as error:
            detail = f"the arms of this figure cannot be controlled: {error}"
            raise ProblemError(
                422, "No puppet's arms", detail, field=f"figure.{error.field}", hint=error.hint
            ) from None
        return figure

    @staticmethod
    def _table(field: str, vectors: dict[str, list[float]], names: Sequence[str]) -> Array:
        table = np.zeros((JOINT_COUNT, 3))
        for name in names:
            if name not in vectors:
                raise invalid_field_problem(("figure", field), f"the joint {name} is missing")
        for name, vector in vectors.items():
            if name not in names:
                raise invalid_field_problem(("figure", field), f"there is no joint {name[:40]!r} here")
            if np.abs(vector).max() > MAX_BONE_M:
                raise invalid_field_problem(("figure", field, name), f"a length exceeds {MAX_BONE_M:g} metres")
            table[JOINTS.index(name)] = vector
        return table


class NewPerformer(BaseModel):
    """Live performer to bring on a stage."""

    model_config = ConfigDict(extra="forbid")
    name: Annotated[str, Field(max_length=200)] = ""
    fps: Annotated[FiniteFloat, Field(ge=10.0, le=240.0, description="samples per second")] = 60.0
    figure: Annotated[FigureLengths | None, Field(description="by default a standard figure of 1.75 m")] = None
    session: Annotated[str | None, Field(max_length=64, description="session to join; by default a new one")] = None
    place: Annotated[
        Vector | None,
        Field(description="x and z, metres, and turn about y, radians, on the stage; by default the next free place"),
    ] = None

    def placement(self) -> Placement | None:
        """Return the placement; raise `ProblemError` (422) for one beyond the stage."""
        try:
            return None if self.place is None else Placement.parse(self.place)
        except ValueError as error:
            raise invalid_field_problem(("place",), str(error)) from None
