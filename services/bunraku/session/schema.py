"""Request bodies of the sessions API."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field


class NewSession(BaseModel):
    """Session to open."""

    model_config = ConfigDict(extra="forbid")
    motion: Annotated[str, Field(max_length=64)]
    loop: bool = True
    playing: bool = True


class SessionEdit(BaseModel):
    """Edits of a session's timeline; omitted fields stay unchanged."""

    model_config = ConfigDict(extra="forbid")
    playing: bool | None = None
    position: Annotated[int | None, Field(ge=0, lt=1 << 53, description="microseconds")] = None
    loop: bool | None = None
    motion: Annotated[str | None, Field(max_length=64)] = None
