"""Inspections of storage: a full disk, power loss after an answer, crashes, a read-only folder. Rows 8, 9, 12 and 18.

The full disk and the read-only folder are a tmpfs, which needs root. System calls are recorded by strace.
"""

from __future__ import annotations

import contextlib
import os
import re
import secrets
import shutil
import subprocess
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx2

from bunraku.http.access_control import Role
from tests.attack.inspection import Unsupported, inspection
from tests.attack.result import AttackResult
from tests.attack.server import run_attacked_server
from tests.credentials import bearer_headers, make_token
from tests.servers import make_bvh_clip

DISK_MB = 24
KILLS = 6
SYSTEM_CALLS = "openat,open,creat,close,fsync,fdatasync,sync_file_range,rename,renameat,renameat2,link,linkat"


@contextmanager
def small_disk(megabytes: int) -> Iterator[Path]:
    """Mount a tmpfs of a size and yield its folder."""
    if os.geteuid() != 0:
        raise Unsupported("a full disk needs root, to mount a tmpfs")
    with tempfile.TemporaryDirectory(prefix="bunraku-attack-disk-") as name:
        mounted = subprocess.run(
            ["mount", "-t", "tmpfs", "-o", f"size={megabytes}m", "bunraku-attack", name], capture_output=True
        )
        if mounted.returncode != 0:
            raise Unsupported("a tmpfs cannot be mounted here")
        try:
            yield Path(name)
        finally:
            # a bind mount lies over it
            while subprocess.run(["umount", "--lazy", name], check=False, capture_output=True).returncode == 0:
                pass


def open_client(url: str, role: Role = Role.ADMIN, subject: str = "host") -> httpx2.Client:
    """Return an HTTP client with a token."""
    # a connection for each request: the server may close one after an error
    limits = httpx2.Limits(max_keepalive_connections=0)
    return httpx2.Client(
        base_url=url, headers=bearer_headers(make_token(role, subject, 3_600)), timeout=60.0, limits=limits
    )


def upload(http: httpx2.Client, seconds: float = 1.0) -> httpx2.Response:
    """Upload a new motion."""
    clip = make_bvh_clip(seconds, secrets.randbelow(1 << 30))
    return http.post("/v1/motions", params={"filename": "inspected.bvh"}, content=clip)


def fill(folder: Path) -> Path:
    """Fill the disk of a folder to the last byte with a file, and return the file."""
    filler = folder / "filler"
    with filler.open("wb", buffering=0) as file, contextlib.suppress(OSError):
        for size in (1 << 20, 4_096, 1):
            with contextlib.suppress(OSError):
                while file.write(bytes(size)):
                    pass
    return filler


@inspection(8, "a revoked link is refused at once; deleting frees space")
def full_disk(result: AttackResult) -> None:
    """Revoke a link and delete motions while the disk is full."""
    with small_disk(DISK_MB) as folder, run_attacked_server(folder) as server, open_client(server.url) as http:
        motions = [upload(http).json()["id"] for _ in range(3)]
        links = [http.post("/v1/shares", json={"motion": motions[0]}).json() for _ in range(2)]
        fill(folder)
        refused = upload(http)
        result.answers[f"upload {refused.status_code}"] = 1
        if refused.status_code != 507:
            result.violations.append(f"an upload was answered with {refused.status_code}, expected 507")
        for link in links:
            revoked = http.delete(f"/v1/shares/{link['id']}")
            used = http.get(f"/v1/motions/{motions[0]}", headers=bearer_headers(link["token"]))
            result.answers[f"revoke {revoked.status_code}, use {used.status_code}"] = 1
            if used.status_code != 401:
                result.violations.append(f"a link revoked with {revoked.status_code} still works: {used.status_code}")
        for motion in motions[1:]:
            deleted = http.delete(f"/v1/motions/{motion}")
            found = http.get(f"/v1/motions/{motion}").status_code
            result.answers[f"delete {deleted.status_code}, get {found}"] = 1
            if (deleted.status_code, found) != (204, 404):
                result.violations.append(f"deleting on a full disk: {deleted.status_code}, then get {found}")
        if http.get(f"/v1/motions/{motions[0]}").status_code != 200:
            result.violations.append("the motion that was not deleted is gone")


@inspection(8, "a link that was revoked on a full disk stays refused after a restart")
def restart_after_a_full_disk(result: AttackResult) -> None:
    """Revoke a link while the disk is full, kill the server, make room and start it again."""
    with small_disk(DISK_MB) as folder:
        with run_attacked_server(folder) as server, open_client(server.url) as http:
            motion = upload(http).json()["id"]
            link = http.post("/v1/shares", json={"motion": motion}).json()
            filler = fill(folder)
            revoked = http.delete(f"/v1/shares/{link['id']}").status_code
            result.answers[f"revoke {revoked}"] = 1
            server.kill()
        filler.unlink()
        with run_attacked_server(folder) as server, open_client(server.url) as http:
            used = http.get(f"/v1/motions/{motion}", headers=bearer_headers(link["token"])).status_code
            result.answers[f"use after the restart {used}"] = 1
            # an answer other than 204 says that the revocation is not durable yet
            if revoked == 204 and used != 401:
                result.violations.append(f"a link revoked with 204 works again after a restart: {used}")


@inspection(18, "problem documents with 503 or 507")
def read_only_data_folder(result: AttackResult) -> None:
    """Change things while the data folder is read-only."""
    with small_disk(DISK_MB) as folder, run_attacked_server(folder) as server, open_client(server.url) as http:
        motion = upload(http).json()["id"]
        link = http.post("/v1/shares", json={"motion": motion}).json()
        subprocess.run(["mount", "-o", "remount,ro", str(folder)], check=False, capture_output=True)
        if os.access(folder, os.W_OK):
            # files that are open for writing keep a mount writable
            bound = subprocess.run(["mount", "--bind", str(folder), str(folder)], capture_output=True).returncode
            bound = bound or subprocess.run(["mount", "-o", "remount,ro,bind", str(folder)]).returncode
            if bound:
                raise Unsupported("the folder cannot be made read-only here")
        try:
            requests: dict[str, Callable[[], httpx2.Response]] = {
                "upload": lambda: upload(http),
                "link": lambda: http.post("/v1/shares", json={"motion": motion}),
                "revoke": lambda: http.delete(f"/v1/shares/{link['id']}"),
                "delete": lambda: http.delete(f"/v1/motions/{motion}"),
                "list": lambda: http.get("/v1/motions"),
            }
            for name, send in requests.items():
                response = send()
                kind = response.headers.get("content-type", "")
                result.answers[f"{name} {response.status_code}"] = 1
                if response.status_code >= 400 and "application/problem+json" not in kind:
                    result.violations.append(f"{name}: {response.status_code} as {kind}")
                if response.status_code == 500:
                    result.violations.append(f"{name}: 500, expected 503 or 507")
        finally:
            subprocess.run(["mount", "-o", "remount,rw", str(folder)], check=False, capture_output=True)


@inspection(9, "fsync of object and folder before the row")
def order_of_system_calls(result: AttackResult) -> None:
    """Record the system calls of an upload and check that the object is durable before its row."""
    if shutil.which("strace") is None:
        raise Unsupported("strace is not installed")
    with tempfile.TemporaryDirectory(prefix="bunraku-attack-") as name:
        trace = Path(name) / "trace"
        strace = ["strace", "-f", "-y", "-s", "0", "-e", f"trace={SYSTEM_CALLS}", "-o", str(trace)]
        with run_attacked_server(Path(name) / "server", wrapper=strace) as server, open_client(server.url) as http:
            upload(http)
            offset = trace.stat().st_size
            answered = upload(http)
            # strace logs a call when it has ended
            time.sleep(0.5)
            calls = trace.read_bytes()[offset:].decode(errors="replace").splitlines()
            motion, library = answered.json()["id"], server.data / "library"
        result.answers[f"upload {answered.status_code}"] = 1
        found = next((path for path in library.rglob("*") if motion in path.name and path.is_file()), None)
        if found is None:
            result.violations.append("the object of the motion was not found in the library")
            return
        check_durability(result, calls, str(found))


def check_durability(result: AttackResult, calls: list[str], stored: str) -> None:
    """Check the order: object synced, renamed, folder synced, then a sync of the catalogue."""
    folder = stored.rpartition("/")[0]
    renames = [at for at, call in enumerate(calls) if re.search(r"rename|link", call) and f'"{stored}"' in call]
    renames += [at for at, call in enumerate(calls) if re.search(r"rename|link", call) and Path(stored).name in call]
    if not renames:
        result.violations.append("no rename of the object was recorded")
        return
    renamed = renames[-1]
    temporary = re.findall(r'"([^"]+)"', calls[renamed])
    source = temporary[0].rpartition("/")[2] if temporary else ""
    syncs = [(at, call) for at, call in enumerate(calls) if "sync(" in call]
    is_file_synced = any(at < renamed and source and f"{source}>" in call for at, call in syncs)
    # the row is durable with the first sync of the catalogue after the rename
    row = next((at for at, call in syncs if at > renamed and "catalogue" in call), len(calls))
    is_folder_synced = any(renamed < at < row and f"<{folder}>" in call for at, call in syncs)
    result.answers |= {"object synced": int(is_file_synced), "folder synced": int(is_folder_synced)}
    if not is_file_synced:
        result.violations.append("the object is renamed without a sync of its content")
    if not is_folder_synced:
        result.violations.append("the row is stored without a sync of the object's folder")
    if row == len(calls):
        result.violations.append("no sync of the catalogue follows the rename before the answer")


@inspection(9, "a row without its object is hidden or repaired at the start")
def object_lost_in_a_power_cut(result: AttackResult) -> None:
    """Remove or cut the object of a stored motion, as a power cut may, and start the server again."""
    with tempfile.TemporaryDirectory(prefix="bunraku-attack-") as name:
        folder = Path(name)
        with run_attacked_server(folder) as server, open_client(server.url) as http:
            motions = [upload(http).json()["id"] for _ in range(3)]
            library = server.data / "library"
            server.kill()
        objects = [next(path for path in library.rglob("*") if one in path.name) for one in motions]
        objects[0].unlink()
        os.truncate(objects[1], objects[1].stat().st_size // 2)
        with run_attacked_server(folder) as server, open_client(server.url) as http:
            until = time.monotonic() + 20.0
            while time.monotonic() < until:
                listed = [one["id"] for one in http.get("/v1/motions").json()["items"]]
                if not set(motions[:2]) & set(listed):
                    break
                time.sleep(0.2)
            for kind, motion in zip(("removed", "cut", "whole"), motions, strict=True):
                status = http.get(f"/v1/motions/{motion}").status_code
                block = http.get(f"/v1/motions/{motion}/blocks/0/0").status_code
                result.answers[f"{kind}: {status}, block {block}"] = 1
                if kind == "whole" and (status, block) != (200, 200):
                    result.violations.append(f"an undamaged motion is answered with {status}, its block with {block}")
                if kind != "whole" and (motion in listed or status != 404 or block >= 500):
                    result.violations.append(f"a motion whose object was {kind} is listed: {status}, block {block}")


@inspection(12, "nothing of killed servers is left after the next start")
def leftovers_of_killed_servers(result: AttackResult) -> None:
    """Kill a server several times during uploads and recordings, start it again, and look for leftovers."""
    with tempfile.TemporaryDirectory(prefix="bunraku-attack-") as name:
        folder, temporary = Path(name), Path(name) / "temporary"
        temporary.mkdir()
        environment = {"TMPDIR": str(temporary)}
        for _ in range(KILLS):
            with run_attacked_server(folder, environment) as server, open_client(server.url) as http:
                session = http.post("/v1/sessions", json={"motion": upload(http).json()["id"]}).json()["id"]
                logs = server.data / "library" / "logs"
                before = _entries(temporary) | _entries(logs)
                requests = (
                    lambda client=http: upload(client, 60.0),
                    lambda client=http, path=f"/v1/sessions/{session}/recordings": client.post(path, json={}),
                )
                sending = [threading.Thread(target=_ignore_errors, args=(one,)) for one in requests]
                for one in sending:
                    one.start()
                until = time.monotonic() + 10.0
                while not (_entries(temporary) | _entries(logs)) - before and time.monotonic() < until:
                    time.sleep(0.005)
                server.kill()
                for one in sending:
                    one.join()
        left_by_kills = _entries(temporary) | _entries(logs)
        result.answers["left by kills"] = len(left_by_kills)
        # the server may keep those of unfinished jobs for a day
        two_days_ago = time.time() - 2 * 86_400
        for entry in (*temporary.rglob("*"), *temporary.iterdir(), *logs.rglob("*")):
            os.utime(entry, (two_days_ago, two_days_ago))
        with run_attacked_server(folder, environment):
            until = time.monotonic() + 20.0
            while (_entries(temporary) | _entries(logs)) & left_by_kills and time.monotonic() < until:
                time.sleep(0.2)
        left = _entries(temporary) | _entries(logs)
        result.answers["left"] = len(left)
        if left:
            result.violations.append(f"{len(left)} entries are left: {', '.join(sorted(left)[:3])}")


def _ignore_errors(request: Callable[[], object]) -> None:
    """Send a request to a server that will be killed."""
    with contextlib.suppress(httpx2.HTTPError):
        request()


def _entries(folder: Path) -> set[str]:
    return {one.name for one in folder.iterdir()} if folder.is_dir() else set()
