from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from bunraku.marionette.solver.limb_solver import PYTHON_SOLVER
from bunraku.session import limb_solver


def test_compiled_solver_is_loaded_once_and_cached_on_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "compiled"))
    assert not limb_solver.is_compiled()
    with ThreadPoolExecutor(2) as servers:
        futures = [servers.submit(limb_solver.load_compiled_solver) for _ in range(2)]
        solver, same = (future.result() for future in futures)
    assert solver is same
    assert limb_solver.is_compiled()
    assert not set(solver) & set(PYTHON_SOLVER)
    assert {path.suffix for path in (tmp_path / "compiled").rglob("*") if path.is_file()} == {".nbi", ".nbc"}
