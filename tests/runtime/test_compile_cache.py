from __future__ import annotations

from pathlib import Path

import pytest

from bunraku.runtime import compile_cache
from bunraku.runtime.compile_cache import compile_cache_folder


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "kernels").mkdir()
    (tmp_path / "kernels" / "one.py").write_text("one = 1\n")
    monkeypatch.setattr(compile_cache, "PACKAGE_FOLDER", tmp_path)
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    return tmp_path


def test_folder_depends_on_the_sources(package: Path) -> None:
    first = compile_cache_folder("kernels")
    assert first is not None
    assert Path(first).is_dir()
    assert compile_cache_folder("kernels") == first
    (package / "kernels" / "two.py").write_text("")
    second = compile_cache_folder("kernels")
    (package / "kernels" / "one.py").write_text("one = 2\n")
    assert len({first, second, compile_cache_folder("kernels")}) == 3


def test_folder_lies_in_numba_cache_dir(package: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(package / "cache"))
    folder = compile_cache_folder("kernels")
    assert folder is not None
    assert Path(folder).parent == package / "cache" / "kernels"


def test_unwritable_folder_is_none(package: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(package / "kernels" / "one.py"))
    assert compile_cache_folder("kernels") is None
