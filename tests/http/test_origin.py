from __future__ import annotations

import pytest

from bunraku.http.origin import is_allowed_origin, is_local_host, parse_origins

ALLOWED_ORIGINS = parse_origins("https://dance.example, http://other.example:8080/")


@pytest.mark.parametrize(
    ("origin", "host"),
    [
        (None, "stage.example"),
        ("http://stage.example", "stage.example"),
        # a proxy has terminated TLS
        ("https://stage.example", "stage.example"),
        ("https://stage.example", "stage.example:443"),
        ("http://stage.example:8000", "stage.example:8000"),
        ("http://[::1]:8000", "[::1]:8000"),
        ("https://dance.example", "stage.example"),
        ("HTTPS://Dance.Example", "stage.example"),
        ("http://other.example:8080", "stage.example"),
    ],
)
def test_own_and_allowed_origins_are_allowed(origin: str | None, host: str) -> None:
    assert is_allowed_origin(origin, host, ALLOWED_ORIGINS)


@pytest.mark.parametrize(
    ("origin", "host"),
    [
        ("null", "stage.example"),
        ("", "stage.example"),
        ("https://evil.example", "stage.example"),
        ("http://stage.example:8001", "stage.example:8000"),
        ("http://stage.example.evil.example", "stage.example"),
        ("http://stage.example@evil.example", "stage.example"),
        ("https://dance.example.evil.example", "stage.example"),
        ("http://dance.example", "stage.example"),
        ("file://stage.example", "stage.example"),
        ("http://stage.example:port", "stage.example"),
        ("http://[::1", "[::1"),
        ("http://stage.example", ""),
    ],
)
def test_other_origins_are_rejected(origin: str, host: str) -> None:
    assert not is_allowed_origin(origin, host, ALLOWED_ORIGINS)


@pytest.mark.parametrize(
    "text", ["dance.example", "https://", "ftp://dance.example", "https://dance.example/page", "*"]
)
def test_invalid_origin_raises(text: str) -> None:
    with pytest.raises(ValueError, match="an origin is like"):
        parse_origins(text)


def test_opaque_origin_is_allowed_only_if_configured() -> None:
    assert is_allowed_origin("null", "stage.example", parse_origins("https://dance.example,null"))
    assert not is_allowed_origin("null", "stage.example", ALLOWED_ORIGINS)


def test_empty_text_has_no_origins() -> None:
    assert parse_origins("") == parse_origins(" , ") == frozenset()


@pytest.mark.parametrize(
    ("host", "is_local"),
    [
        ("127.0.0.1:8000", True),
        ("localhost:8000", True),
        ("stage.localhost", True),
        ("stage", True),
        ("[::1]:8000", True),
        ("192.168.1.5:8000", True),
        ("dance.example", True),
        ("", True),
        ("evil.example:8000", False),
        ("127.0.0.1.evil.example", False),
        ("localhost.", True),
        ("evil.example.", False),
        ("[::1", False),
    ],
)
def test_foreign_host_names_are_not_local(host: str, is_local: bool) -> None:
    assert is_local_host(host, ALLOWED_ORIGINS) is is_local
