from __future__ import annotations

from pathlib import Path

import pytest

from bunraku.runtime import compile_cache
from bunraku.runtime.compile_cache import compile_cache_folder


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "room").mkdir()
    (tmp_path / "room" / "one.py").write_text("one = 1\n")
    monkeypatch.setattr(compile_cache, "PACKAGE_FOLDER", tmp_path)
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    return tmp_path


def test_other_sources_have_another_folder_and_the_same_have_the_same(package: Path) -> None:
    first = compile_cache_folder("room")
    assert first is not None
    assert Path(first).is_dir()
    assert compile_cache_folder("room") == first
    (package / "room" / "two.py").write_text("")
    second = compile_cache_folder("room")
    (package / "room" / "one.py").write_text("one = 2\n")
    assert len({first, second, compile_cache_folder("room")}) == 3


def test_the_folder_lies_where_one_was_asked_for(package: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(package / "elsewhere"))
    folder = compile_cache_folder("room")
    assert folder is not None
    assert Path(folder).parent == package / "elsewhere" / "room"


def test_where_nothing_can_be_written_there_is_none(package: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(package / "room" / "one.py"))
    assert compile_cache_folder("room") is None
