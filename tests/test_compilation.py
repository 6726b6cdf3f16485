"""First compilation of the kernels. The real one takes a minute, so other programs stand for it here."""

from __future__ import annotations

import asyncio
import logging
import os
from pathlib import Path

import httpx2
import pytest

from bunraku import compilation
from bunraku.session import limb_solver
from tests.servers import make_bvh_clip, run_server
from tests.time_limit import HANG_TIMEOUT_S


async def test_process_gets_no_settings(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("BUNRAKU_SECRET", "not for programs that read kernels")
    kept = tmp_path / "environment"
    monkeypatch.setattr(
        compilation, "_COMPILE", f"import os, pathlib; pathlib.Path({str(kept)!r}).write_text(str(dict(os.environ)))"
    )
    await compilation.compile_kernels()
    assert "BUNRAKU" not in kept.read_text()


async def test_failure_is_logged(monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture) -> None:
    monkeypatch.setattr(compilation, "_COMPILE", "raise SystemExit('no space left')")
    with caplog.at_level(logging.WARNING):
        await compilation.compile_kernels()
    assert "no space left" in caplog.text


async def test_compilation_without_end_is_ended(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(compilation, "_COMPILE", _waiting_program(tmp_path))
    monkeypatch.setattr(compilation, "COMPILATION_TIMEOUT_S", 0.5)
    await compilation.compile_kernels()
    assert "did not end within 0.5 s" in caplog.text


async def test_cancellation_ends_the_process(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compilation, "_COMPILE", _waiting_program(tmp_path))
    compiling = asyncio.create_task(compilation.compile_kernels())
    async with asyncio.timeout(HANG_TIMEOUT_S):
        while not (tmp_path / "started").exists():  # noqa: ASYNC110 - nothing announces a file
            await asyncio.sleep(0.01)
    compiling.cancel()
    await asyncio.wait((compiling,))
    assert compiling.cancelled()
    with pytest.raises(ProcessLookupError):
        os.kill(int((tmp_path / "started").read_text()), 0)


async def test_uploads_wait_for_the_compilation_and_say_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(limb_solver, "is_compiled", lambda: False)
    monkeypatch.setattr(compilation, "_COMPILE", _waiting_program(tmp_path))
    with run_server(tmp_path / "data") as url:
        async with httpx2.AsyncClient(base_url=url, timeout=HANG_TIMEOUT_S) as http:
            query = {"filename": "clip.bvh", "upload": "upload-one"}
            posting = asyncio.create_task(http.post("/v1/motions", params=query, content=make_bvh_clip()))
            async with asyncio.timeout(HANG_TIMEOUT_S):
                while (await http.get("/v1/uploads/upload-one")).json().get("stage") != "preparing":  # noqa: ASYNC110
                    await asyncio.sleep(0.01)
            # a session can be opened and watched meanwhile
            assert (await http.get("/v1/sessions")).status_code == 200
            assert not posting.done()
            (tmp_path / "end").touch()
            assert (await posting).status_code == 201


def _waiting_program(folder: Path) -> str:
    """Return a program that writes its process id to the file `started` and waits for the file `end`."""
    return f"""
import os, pathlib, time
folder = pathlib.Path({str(folder)!r})
(folder / "id").write_text(str(os.getpid()))
(folder / "id").rename(folder / "started")
while not (folder / "end").exists():
    time.sleep(0.01)
"""
