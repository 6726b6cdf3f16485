from __future__ import annotations

import pytest
from starlette.requests import HTTPConnection

from bunraku.http.access_control import (
    ACCESS_SCOPE_KEY,
    DEFAULT_MAX_BODY_BYTES,
    FULL_ACCESS,
    Access,
    Requirement,
    Role,
    access_of,
    requirement_of,
    requires,
)


def test_roles_are_ordered_and_parse_their_labels() -> None:
    labels = [role.label for role in Role]
    assert labels == ["view", "control", "ingest", "admin"]
    assert [Role.parse(label) for label in labels] == sorted(Role)
    with pytest.raises(ValueError, match="view, control, ingest, admin"):
        Role.parse("owner")


def test_requires_declares_the_requirement_of_an_endpoint() -> None:
    @requires(Role.VIEW, allow_bound=True)
    def endpoint() -> None: ...

    assert requirement_of(endpoint) == Requirement(Role.VIEW, True, DEFAULT_MAX_BODY_BYTES)
    assert requirement_of(test_requires_declares_the_requirement_of_an_endpoint) is None


def test_access_is_full_without_authorization_middleware() -> None:
    assert access_of(HTTPConnection({"type": "http"})) == FULL_ACCESS
    assert access_of(HTTPConnection({"type": "http", ACCESS_SCOPE_KEY: Access(Role.VIEW)})) == Access(Role.VIEW)
