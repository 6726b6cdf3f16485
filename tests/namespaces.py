"""Network namespaces for tests: machines with addresses of their own, joined by virtual cables (root, Linux)."""

from __future__ import annotations

import ctypes
import os
import shutil
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

_NEW_NETWORK = 0x40000000
_LIBC = ctypes.CDLL(None, use_errno=True)


def missing_requirement() -> str | None:
    """Return why there can be no network namespaces here, None if there can."""
    if sys.platform != "linux" or os.geteuid() != 0:
        return "network namespaces need Linux and root"
    if shutil.which("ip") is None:
        return "there is no `ip`: install iproute2"
    return None


def require_namespaces() -> None:
    """Skip the test without network namespaces; fail in CI."""
    if (reason := missing_requirement()) is not None:
        if os.environ.get("CI"):
            pytest.fail(f"required in CI: {reason}")
        pytest.skip(reason)


@contextmanager
def open_namespace(name: str) -> Iterator[str]:
    """Create a namespace with a loopback device, and remove it with its devices at the end of the block."""
    run_ip(f"netns add {name}")
    try:
        run_ip(f"-n {name} link set lo up")
        yield name
    finally:
        run_ip(f"netns del {name}")


def join_namespaces(first: str, second: str, network: int) -> tuple[str, str]:
    """Join two namespaces by a pair of devices; return their addresses in the network 10.98.`network`.0."""
    device, addresses = f"veth{network}", (f"10.98.{network}.1", f"10.98.{network}.2")
    run_ip(f"link add {device} netns {first} type veth peer name {device} netns {second}")
    for namespace, address in zip((first, second), addresses, strict=True):
        run_ip(f"-n {namespace} addr add {address}/30 dev {device}")
        run_ip(f"-n {namespace} link set {device} up")
    return addresses


def command_in(namespace: str) -> tuple[str, ...]:
    """Return the beginning of a command that runs in a namespace; the process is that of the command."""
    return "ip", "netns", "exec", namespace


@contextmanager
def in_namespace(name: str) -> Iterator[None]:
    """Keep this thread, and all that it starts, in a namespace until the end of the block."""
    own_namespace = os.open(f"/proc/self/task/{threading.get_native_id()}/ns/net", os.O_RDONLY)
    target_namespace = os.open(f"/run/netns/{name}", os.O_RDONLY)
    try:
        _enter_namespace(target_namespace)
        yield
    finally:
        _enter_namespace(own_namespace)
        os.close(own_namespace)
        os.close(target_namespace)


def run_ip(arguments: str) -> None:
    """Run a command of iproute2."""
    subprocess.run(["ip", *arguments.split()], check=True)


def _enter_namespace(fd: int) -> None:
    if _LIBC.setns(fd, _NEW_NETWORK) != 0:
        raise OSError(ctypes.get_errno(), "the network namespace cannot be entered")
