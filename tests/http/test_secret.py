from __future__ import annotations

from pathlib import Path

import pytest

from bunraku.http.access_token import MIN_SECRET_BYTES
from bunraku.http.secret import SECRET_FILE_NAME, is_loopback, load_or_create_secret, load_secret


def test_secret_is_created_once_and_readable_by_its_owner_only(tmp_path: Path) -> None:
    folder = tmp_path / "data"
    assert load_secret(folder) is None
    secret = load_or_create_secret(folder)
    assert len(secret) >= MIN_SECRET_BYTES
    assert (folder / SECRET_FILE_NAME).stat().st_mode & 0o777 == 0o600
    assert load_or_create_secret(folder) == load_secret(folder) == secret
    assert load_or_create_secret(tmp_path / "other") != secret


def test_readable_or_short_secret_raises(tmp_path: Path) -> None:
    load_or_create_secret(tmp_path)
    (tmp_path / SECRET_FILE_NAME).chmod(0o640)
    with pytest.raises(ValueError, match="chmod 600"):
        load_or_create_secret(tmp_path)
    (tmp_path / SECRET_FILE_NAME).chmod(0o600)
    (tmp_path / SECRET_FILE_NAME).write_text("short")
    with pytest.raises(ValueError, match="at least 32 bytes"):
        load_or_create_secret(tmp_path)


@pytest.mark.parametrize(
    ("host", "expected"),
    [
        ("127.0.0.1", True),
        ("127.1.2.3", True),
        ("::1", True),
        ("localhost", True),
        ("0.0.0.0", False),
        ("::", False),
        ("192.168.1.5", False),
        ("stage.example", False),
        ("", False),
    ],
)
def test_loopback_hosts(host: str, expected: bool) -> None:
    assert is_loopback(host) is expected
