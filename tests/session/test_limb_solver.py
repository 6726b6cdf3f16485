from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from bunraku.marionette import elbow, jit
from bunraku.session import limb_solver


@pytest.fixture(autouse=True)
def _plain_again() -> Iterator[None]:
    yield
    jit.disable()


def test_limbs_are_solved_by_what_is_compiled_and_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "compiled"))
    jit.disable()
    plain = elbow.step_elbow
    with ThreadPoolExecutor(2) as servers:
        for loaded in [servers.submit(limb_solver.warm_up_solver) for _ in range(2)]:
            loaded.result()
    assert elbow.step_elbow is not plain
    assert {path.suffix for path in (tmp_path / "compiled").rglob("*") if path.is_file()} == {".nbi", ".nbc"}
