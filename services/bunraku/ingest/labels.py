"""Names and tags of stored motions, which their subjects may change. The motions themselves stay immutable."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field

from bunraku.http.access_control import Access, Role
from bunraku.runtime.display_text import MAX_NAME_CHARACTERS, clean_text
from bunraku.runtime.problem import ProblemError
from bunraku.storage.record import CatalogueEntry, StoredProp
from bunraku.storage.search_text import fold_text

MAX_TAGS = 16
"""Maximum number of tags of a motion."""
MAX_TAG_CHARACTERS = 40
MAX_LABELS_BYTES = 12 << 10
"""Maximum size of a request: a name and 16 tags of characters that JSON escapes with 12 bytes."""


def clean_name(name: str) -> str:
    """Return a name as it is stored; raise ValueError if nothing of it is visible."""
    return _require_visible(clean_text(name))


def _clean_tag(tag: str) -> str:
    return _require_visible(clean_text(tag, MAX_TAG_CHARACTERS))


def _refuse_empty(text: Any) -> Any:
    """Give an empty text the reason of one without a visible character."""
    return _require_visible(text) if isinstance(text, str) else text


def _require_visible(text: str) -> str:
    if not text:
        raise ValueError("it must have at least one visible character")
    return text


def _require_unique(tags: list[str]) -> list[str]:
    folded = [fold_text(tag) for tag in tags]
    for index, each in enumerate(folded):
        if each in folded[:index]:
            raise ValueError(f"{tags[index]!r} occurs twice")
    return tags


def _omit_default(schema: dict[str, Any]) -> None:
    """Remove the default from the schema of a field: an absent one has no value."""
    schema.pop("default", None)


_Text = Annotated[str, BeforeValidator(_refuse_empty)]
Name = Annotated[_Text, Field(min_length=1, max_length=MAX_NAME_CHARACTERS), AfterValidator(clean_name)]
Tag = Annotated[_Text, Field(min_length=1, max_length=MAX_TAG_CHARACTERS), AfterValidator(_clean_tag)]


class Labels(BaseModel):
    """New name and tags of a motion; an absent one stays as it is."""

    model_config = ConfigDict(extra="forbid")
    name: Annotated[Name, Field(json_schema_extra=_omit_default)] = ""
    tags: Annotated[
        list[Tag], Field(max_length=MAX_TAGS, json_schema_extra=_omit_default), AfterValidator(_require_unique)
    ] = []

    def apply(self, description: dict[str, Any]) -> dict[str, Any]:
        """Return the description of a motion with these labels; raise `ProblemError` (422) if there are none."""
        if not self.model_fields_set:
            raise ProblemError(422, "Nothing to change", "the request has neither a name nor tags", field="name")
        return {**description, **self.model_dump(exclude_unset=True)}


def require_ownership(access: Access, entry: CatalogueEntry | StoredProp, change: str) -> None:
    """Raise `ProblemError` (403) unless a client may change an entry: it stored the entry, or has the role admin."""
    if access.role < Role.ADMIN and entry.subject != access.subject:
        detail = f"{entry.id} was stored by another subject; {change} it needs the role admin"
        raise ProblemError(403, "Not allowed", detail, needed="admin")


def combined_tags(entries: Iterable[CatalogueEntry]) -> list[str]:
    """Return the tags of several motions, each once, at most `MAX_TAGS`."""
    tags: dict[str, str] = {}
    for entry in entries:
        for tag in entry.description.get("tags") or []:
            tags.setdefault(fold_text(tag), tag)
    return list(tags.values())[:MAX_TAGS]
