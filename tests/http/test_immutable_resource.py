from __future__ import annotations

import pytest

from bunraku.http.immutable_resource import immutable_headers, not_modified


@pytest.mark.parametrize("header", ['"a"', 'W/"a"', '"b", "a"', "*"])
def test_client_that_has_the_resource_gets_304(header: str) -> None:
    response = not_modified(header, '"a"')
    assert response is not None
    assert response.status_code == 304
    assert response.headers["etag"] == '"a"'
    assert "immutable" in response.headers["cache-control"]


@pytest.mark.parametrize("header", [None, "", '"b"', "a", 'W/"b", "c"'])
def test_other_client_gets_the_resource(header: str | None) -> None:
    assert not_modified(header, '"a"') is None


def test_resource_is_cached_for_a_year() -> None:
    assert immutable_headers('"a"') == {"ETag": '"a"', "Cache-Control": "public, max-age=31536000, immutable"}
