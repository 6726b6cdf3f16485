"""Emulated constrained links for benchmarks and tests.

Network namespaces are joined by TUN devices, with kernel TCP at both ends.

Needs root, Linux and iproute2, and `links/narrowlink.py` from the folder of shared material, which implements queue,
bitrate and delay of a link. Several links run side by side, each to a separate far end.
"""

from __future__ import annotations

import importlib.util
import multiprocessing
import os
import select
import socket
import subprocess
import time
from argparse import Namespace
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tests import namespaces
from tests.namespaces import command_in, in_namespace, open_namespace, run_ip

REPOSITORY = Path(__file__).resolve().parents[2]


def narrowlink_path() -> Path:
    """Return the expected path of `narrowlink.py`."""
    return Path(os.environ.get("BUNRAKU_SHARED") or REPOSITORY.parent / "shared") / "links" / "narrowlink.py"


def missing_requirement() -> str | None:
    """Return why links cannot be emulated here, None if they can."""
    if not narrowlink_path().is_file():
        return f"there is no {narrowlink_path()}; set BUNRAKU_SHARED to the folder of shared material"
    if (reason := namespaces.missing_requirement()) is not None:
        return reason
    if not Path("/dev/net/tun").exists():
        return "there is no /dev/net/tun"
    return None


@dataclass(frozen=True)
class EmulatedLink:
    """Emulated link: bit/s in each direction, one-way delay, and the buffer of the router.

    `bitrate_steps` is 'seconds:bit/s,...'; `trace` is a file of milliseconds and kbit/s, whose bitrates are multiplied
    by `trace_scale`. Both start when the link opens. No packet passes between the two times of `outage_s`, seconds
    after the start."""

    bitrate: float = 28_800.0
    delay_ms: float = 75.0
    queue_bytes: int = 8192
    bitrate_steps: str = ""
    trace: str = ""
    trace_scale: float = 1.0
    outage_s: tuple[float, float] = (0.0, 0.0)


@dataclass
class FarEnd:
    """Far end of a link: sockets opened there reach the near end at `host`."""

    namespace: str
    host: str
    link: EmulatedLink
    device: str
    byte_counters: Any = field(default=None, repr=False)

    def open_socket(self) -> socket.socket:
        """Open an unconnected TCP socket at the far end; the calling thread stays in its namespace."""
        with in_namespace(self.namespace):
            opened = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        opened.setblocking(False)
        opened.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return opened

    @property
    def received_bytes(self) -> int:
        """Bytes of IP packets that the link has delivered to the far end."""
        return int(self.byte_counters[0])


class EmulatedNetwork:
    """The near namespace, in which the server and this thread run, and the links opened so far."""

    def __init__(self, near: str) -> None:
        self.near_namespace = near
        self._link_count = 0
        self._namespaces: list[str] = []

    def run(self, command: Sequence[str], **options: Any) -> subprocess.Popen[str]:
        """Start a process at the near end; `options` are those of `subprocess.Popen`."""
        return subprocess.Popen([*command_in(self.near_namespace), *command], text=True, **options)

    @contextmanager
    def open_links(self, links: Sequence[EmulatedLink]) -> Iterator[list[FarEnd]]:
        """Open links and yield their far ends; the links start now and close at the end of the block."""
        module = _load_narrowlink()
        counters = multiprocessing.Array("q", 2 * len(links))
        fars: list[FarEnd] = []
        devices: list[tuple[int, int]] = []
        first_number = self._link_count
        try:
            for nth, link in enumerate(links):
                number, self._link_count = self._link_count, self._link_count + 1
                far, near_host, far_host = (
                    f"{self.near_namespace}f{number}",
                    _host_address(number, 1),
                    _host_address(number, 2),
                )
                names = [f"bn{os.getpid() % 100_000}x{number}{end}" for end in "ab"]
                devices.append((module.tun(names[0]), module.tun(names[1])))
                run_ip(f"netns add {far}")
                self._namespaces.append(far)
                for namespace, name, host, peer in (
                    (self.near_namespace, names[0], near_host, far_host),
                    (far, names[1], far_host, near_host),
                ):
                    run_ip(f"link set {name} netns {namespace}")
                    run_ip(f"-n {namespace} addr add {host} peer {peer} dev {name}")
                    run_ip(f"-n {namespace} link set {name} up mtu 1500 txqueuelen 1000")
                fars.append(FarEnd(far, near_host, link, names[1]))
                fars[-1].byte_counters = _Counter(counters, 2 * nth)
            pump = multiprocessing.get_context("fork").Process(
                target=_run_links, args=(module, list(links), devices, counters), daemon=True
            )
            pump.start()
            try:
                yield fars
            finally:
                pump.terminate()
                pump.join()
        finally:
            for pair in devices:
                for fd in pair:
                    os.close(fd)
            for number in range(first_number, self._link_count):
                self._remove(f"{self.near_namespace}f{number}")

    def _remove(self, namespace: str) -> None:
        if namespace in self._namespaces:
            self._namespaces.remove(namespace)
            subprocess.run(["ip", "netns", "del", namespace], check=False, stderr=subprocess.DEVNULL)


class _Counter:
    """The counters of one far end."""

    def __init__(self, counters: Any, at: int) -> None:
        self._counted, self._at = counters, at

    def __getitem__(self, nth: int) -> int:
        return int(self._counted[self._at + nth])


@contextmanager
def open_network() -> Iterator[EmulatedNetwork]:
    """Create a near end; this thread, and all it starts, runs in it until the end of the block."""
    name = f"bunraku{os.getpid()}"
    with open_namespace(name), in_namespace(name):
        yield EmulatedNetwork(name)


def _host_address(number: int, end: int) -> str:
    return f"10.{99 + number // 250}.{number % 250}.{end}"


def _load_narrowlink() -> Any:
    spec = importlib.util.spec_from_file_location("narrowlink", narrowlink_path())
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def _run_links(module: Any, links: list[EmulatedLink], devices: list[tuple[int, int]], counters: Any) -> None:
    """Forward the packets of all links until the process is terminated.

    `counters` receives the bytes delivered to each far end and to the near end."""
    os.nice(-15)
    started = time.monotonic()
    directions: dict[int, Any] = {}
    outages: dict[int, tuple[float, float]] = {}
    for link, (near, far) in zip(links, devices, strict=True):
        link_arguments = Namespace(rate=link.bitrate, step=link.bitrate_steps, trace=link.trace, scale=link.trace_scale)
        rate_at = module.rates(link_arguments, started)
        for source, sink in ((near, far), (far, near)):
            directions[source] = module.Direction(sink, rate_at, link.delay_ms / 1e3, link.queue_bytes, 0.0)
            outages[source] = link.outage_s
    order = [fd for pair in devices for fd in pair]
    while True:
        now = time.monotonic()
        due = min(direction.step(now) for direction in directions.values())
        for nth, fd in enumerate(order):
            counters[nth] = directions[fd].sent
        ready, _, _ = select.select(order, [], [], max(0.0, min(due - time.monotonic(), 0.2)))
        now = time.monotonic()
        for fd in ready:
            begin, end = outages[fd]
            for _ in range(64):
                try:
                    packet = os.read(fd, 65536)
                except BlockingIOError:
                    break
                if not begin <= now - started < end:
                    directions[fd].put(packet, now)
