"""Inspections of processes: what a hostile file could reach, and what names do to a terminal. Rows 13 and 16."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from urllib.parse import quote

from tests.attack.attack_access import HOSTILE_NAMES
from tests.attack.inspect_storage import open_client, upload
from tests.attack.inspection import inspection
from tests.attack.resources import process_tree
from tests.attack.result import AttackResult
from tests.attack.server import ServerUnderAttack, run_attacked_server
from tests.credentials import SECRET, make_token
from tests.servers import make_bvh_clip

DATABASE_URL_NAME = "BUNRAKU_CATALOGUE"
STORE_KEY = "the key of an object store"


@inspection(13, "workers have no secrets, no privileges and few descriptors")
def environment_of_workers(result: AttackResult) -> None:
    """Look at the processes that decode a file while they do."""
    with tempfile.TemporaryDirectory(prefix="bunraku-attack-") as name:
        environment = {"AWS_SECRET_ACCESS_KEY": STORE_KEY}
        with run_attacked_server(Path(name), environment) as server, open_client(server.url) as http:
            upload(http)
            sending = threading.Thread(target=upload, args=(http, 60.0))
            sending.start()
            seen: dict[int, list[str]] = {}
            while sending.is_alive():
                for pid in process_tree(server.pid)[1:]:
                    seen[pid] = inspect_worker(pid, server) or seen.get(pid, [])
                time.sleep(0.02)
            sending.join()
        result.answers["workers"] = len(seen)
        if not seen:
            result.violations.append("no process other than the server was seen")
        result.violations += sorted({one for found in seen.values() for one in found})


def inspect_worker(pid: int, server: ServerUnderAttack) -> list[str]:
    """Return what a worker could use if it were taken over; nothing if it has ended."""
    proc = Path("/proc") / str(pid)
    try:
        environ = (proc / "environ").read_bytes().decode(errors="replace")
        status = dict(line.split(":\t", 1) for line in (proc / "status").read_text().splitlines() if ":\t" in line)
        limits = (proc / "limits").read_text()
        descriptors = [str(one.readlink()) for one in (proc / "fd").iterdir()]
        command = (proc / "cmdline").read_bytes().decode(errors="replace")
    except OSError:
        return []
    # the resource tracker of multiprocessing handles no file
    if "resource_tracker" in command:
        return []
    found = []
    if SECRET in environ or STORE_KEY in environ:
        found.append("the environment of a worker has the secret")
    if status.get("NoNewPrivs") == "0":
        found.append("a worker may gain privileges (NoNewPrivs is 0)")
    listening = _listening_inodes(server.pid, server.port)
    if any(one in listening for one in descriptors):
        found.append("a worker has the listening socket")
    if any("catalogue" in one or "/secret" in one for one in descriptors):
        found.append("a worker has the database open")
    core = next(line for line in limits.splitlines() if line.startswith("Max core"))
    if core.split()[4] != "0":
        found.append("a worker may write core dumps, which hold memory")
    return found


def _listening_inodes(pid: int, port: int) -> set[str]:
    """Return the descriptors' names of sockets that listen on a port."""
    rows = [line.split() for line in Path(f"/proc/{pid}/net/tcp").read_text().splitlines()[1:]]
    return {f"socket:[{row[9]}]" for row in rows if row[1].endswith(f":{port:04X}") and row[3] == "0A"}


@inspection(16, "`bunraku list` prints no control characters")
def names_on_a_terminal(result: AttackResult) -> None:
    """List motions with hostile names in a terminal, and one whose name was stored by an older release."""
    with tempfile.TemporaryDirectory(prefix="bunraku-attack-") as name:
        with run_attacked_server(Path(name)) as server, open_client(server.url) as http:
            for number, hostile in enumerate(HOSTILE_NAMES.values()):
                clip = make_bvh_clip(0.3, 500 + number)
                response = http.post(f"/v1/motions?filename={quote(hostile)}.bvh", content=clip)
                result.answers[str(response.status_code)] = result.answers.get(str(response.status_code), 0) + 1
            _store_hostile_name(server.data / "catalogue.sqlite")
            command = [sys.executable, "-m", "bunraku.cli", "list", "--server", server.url, "--token", make_token()]
            printed = subprocess.run(command, capture_output=True, timeout=60, check=False).stdout.decode()
        found = sorted({one for one in printed if (not one.isprintable() and one != "\n")})
        result.answers["lines"] = printed.count("\n")
        if found:
            codes = " ".join(f"U+{ord(one):04X}" for one in found)
            result.violations.append(f"`bunraku list` prints {codes}")


def _store_hostile_name(catalogue: Path) -> None:
    """Change the name of the newest motion in the catalogue to one with control characters."""
    import sqlite3

    with sqlite3.connect(catalogue, timeout=20.0) as connection:
        tables = [row[0] for row in connection.execute("SELECT name FROM sqlite_master WHERE type = 'table'")]
        for table in tables:
            columns = [row[1] for row in connection.execute(f"PRAGMA table_info({table})")]
            if "name" in columns:
                connection.execute(f"UPDATE {table} SET name = ? WHERE rowid = 1", ("old\x1b]0;owned\x07\u202e",))
