from __future__ import annotations

from pathlib import Path

import pytest

from bunraku.backing.secret import NAME, is_loopback, kept_secret, own_secret
from bunraku.backing.tokens import SHORTEST_SECRET


def test_a_secret_is_made_once_and_its_owner_alone_reads_it(tmp_path: Path) -> None:
    folder = tmp_path / "data"
    assert kept_secret(folder) is None
    secret = own_secret(folder)
    assert len(secret) >= SHORTEST_SECRET
    assert (folder / NAME).stat().st_mode & 0o777 == 0o600
    assert own_secret(folder) == kept_secret(folder) == secret
    assert own_secret(tmp_path / "other") != secret


def test_one_that_others_can_read_or_that_is_short_is_refused(tmp_path: Path) -> None:
    own_secret(tmp_path)
    (tmp_path / NAME).chmod(0o640)
    with pytest.raises(ValueError, match="chmod 600"):
        own_secret(tmp_path)
    (tmp_path / NAME).chmod(0o600)
    (tmp_path / NAME).write_text("short")
    with pytest.raises(ValueError, match="at least 32 bytes"):
        own_secret(tmp_path)


@pytest.mark.parametrize(
    ("host", "alone"),
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
def test_who_reaches_a_host(host: str, alone: bool) -> None:
    assert is_loopback(host) is alone
