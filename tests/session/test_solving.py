from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from bunraku.marionette import compiled, elbow
from bunraku.session import solving


@pytest.fixture(autouse=True)
def _plain_again() -> Iterator[None]:
    yield
    compiled.unload()


def test_limbs_are_solved_by_what_is_compiled_and_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "compiled"))
    compiled.unload()
    plain = elbow.hang
    with ThreadPoolExecutor(2) as servers:
        for loaded in [servers.submit(solving.warm) for _ in range(2)]:
            loaded.result()
    assert elbow.hang is not plain
    assert {path.suffix for path in (tmp_path / "compiled").rglob("*") if path.is_file()} == {".nbi", ".nbc"}
