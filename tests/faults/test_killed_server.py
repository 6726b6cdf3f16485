"""Files that remain after `kill -9` of a server during uploads."""

from __future__ import annotations

import contextlib
import os
import re
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import urlsplit

import httpx2

from tests.servers import make_bvh_clip
from tests.time_limit import HANG_TIMEOUT_S

BUNRAKU = Path(sys.executable).parent / "bunraku"
KILLS = int(os.environ.get("BUNRAKU_KILLS", "3"))


@contextmanager
def run_command(folder: Path) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """Run `bunraku up` with data and temporary files in a folder; yield its process and address."""
    (folder / "temporary").mkdir(exist_ok=True)
    with (folder / "log").open("ab") as log:
        process = subprocess.Popen(
            [BUNRAKU, "up", "--port", "0", "--data", folder / "data"],
            stdout=subprocess.PIPE,
            stderr=log,
            text=True,
            env={**os.environ, "TMPDIR": str(folder / "temporary"), "NO_COLOR": "1", "COLUMNS": "200"},
        )
    assert process.stdout is not None
    try:
        address = next(found[1] for line in process.stdout if (found := re.search(r"is at (http://\S+)/", line)))
        yield process, address
    finally:
        process.kill()
        process.communicate()


def left_files(folder: Path) -> list[str]:
    """Return the temporary files and folders, and the objects that are no motions."""
    library = folder / "data" / "library"
    kept = [library / "owner", *(library / "motions").glob("*.bunraku"), *(library / "notes").glob("*")]
    return [
        *(path.name for path in (folder / "temporary").iterdir()),
        *(path.name for path in library.rglob("*") if path.is_file() and path not in kept),
    ]


def is_working(temporary: Path) -> bool:
    """Return whether a server receives a file and has begun to start workers."""
    return bool(list(temporary.glob("bunraku-workers-*")) and list(temporary.glob("bunraku-upload-*/source")))


def running_workers(folder: Path) -> list[int]:
    """Return the processes that have the temporary folder in their environment."""
    own = f"TMPDIR={folder / 'temporary'}\0".encode()
    found = []
    for path in Path("/proc").glob("[0-9]*/environ"):
        with contextlib.suppress(OSError):
            if own in path.read_bytes():
                found.append(int(path.parent.name))
    return found


def wait_until(condition: Callable[[], bool], reason: str) -> None:
    deadline = time.monotonic() + HANG_TIMEOUT_S
    while not condition():
        assert time.monotonic() < deadline, reason
        time.sleep(0.02)


def test_nothing_is_left_after_kills_and_the_next_start(tmp_path: Path) -> None:
    clip = make_bvh_clip(10.0)
    library = tmp_path / "data" / "library"
    for _ in range(KILLS):
        with run_command(tmp_path) as (process, url):
            parts = urlsplit(url)

            def upload(address: str) -> None:
                with contextlib.suppress(httpx2.HTTPError):
                    httpx2.post(f"{address}/v1/motions?filename=a.bvh", content=clip, timeout=HANG_TIMEOUT_S)

            sending = threading.Thread(target=upload, args=(url,))
            sending.start()
            # a second upload stops in the middle
            with socket.create_connection((parts.hostname, parts.port)) as stopped:
                head = (
                    f"POST /v1/motions?filename=b.bvh HTTP/1.1\r\nHost: {parts.netloc}\r\nContent-Length: 1000\r\n\r\n"
                )
                stopped.sendall(head.encode() + b"part")
                wait_until(lambda: is_working(tmp_path / "temporary"), "the upload does not begin")
                process.send_signal(signal.SIGKILL)
                process.wait()
            sending.join()
        # files of sessions that were being recorded
        (library / "logs").mkdir(parents=True, exist_ok=True)
        (library / "logs" / "session-log").write_bytes(b"log")
        assert left_files(tmp_path)
        wait_until(lambda: not running_workers(tmp_path), "workers outlive their server")
    with run_command(tmp_path) as (process, url):
        # the server itself has a folder for its workers, once it runs the uploads that were complete
        def is_clean() -> bool:
            return all(name.startswith("bunraku-workers-") for name in left_files(tmp_path))

        wait_until(is_clean, f"still there: {left_files(tmp_path)}")
        assert len(list((tmp_path / "temporary").iterdir())) <= 1
        assert httpx2.get(f"{url}/v1/health").status_code == 200
        process.send_signal(signal.SIGINT)
        process.wait(HANG_TIMEOUT_S)
    assert left_files(tmp_path) == []
