"""Messages of intact and of hostile workers."""

from __future__ import annotations

import os
import pickle
from dataclasses import dataclass
from multiprocessing import Pipe
from pathlib import Path
from typing import Any

import msgpack
import pytest

from bunraku.runtime import worker_message
from bunraku.runtime.worker_message import InvalidWorkerMessage, receive_message, send_message


@dataclass(frozen=True, slots=True)
class Encoded:
    data: bytes
    size: int
    details: dict[str, Any]
    hint: str | None = None


@dataclass(frozen=True, slots=True)
class Other:
    data: bytes


@pytest.mark.parametrize(
    "value", [0.5, "text", None, b"", b"x" * 70_000, [1, {"a": b"b"}], Encoded(b"\x00" * 70_000, 5, {"あ": [1.5]})]
)
def test_value_arrives_unchanged(value: object, monkeypatch: pytest.MonkeyPatch) -> None:
    # a pipe has 64 KiB
    monkeypatch.setattr(worker_message, "MAX_BULK_BYTES", 80_000)
    receiver, sender = Pipe()
    if isinstance(value, bytes | Encoded):
        import threading

        sending = threading.Thread(target=send_message, args=(sender, "result", value))
        sending.start()
        assert receive_message(receiver, [Encoded]) == ("result", value)
        sending.join()
        return
    send_message(sender, "result", value)
    assert receive_message(receiver, [Encoded]) == ("result", value)


class RunsCode:
    """Object whose unpickling creates a file."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self) -> tuple[Any, ...]:
        return os.mkdir, (str(self.path),)


def test_pickled_code_is_not_run(tmp_path: Path) -> None:
    receiver, sender = Pipe()
    sender.send(RunsCode(tmp_path / "ran"))
    with pytest.raises(InvalidWorkerMessage):
        receive_message(receiver, [Encoded])
    assert not (tmp_path / "ran").exists()
    pickle.loads(pickle.dumps(RunsCode(tmp_path / "ran")))
    assert (tmp_path / "ran").exists()


@pytest.mark.parametrize(
    "head",
    [
        b"",
        b"\xc1",
        b"\xdd\xff\xff\xff\xff",
        b"\x91" * 5_000,
        msgpack.packb(5),
        msgpack.packb(["result", "", {}, []]),
        msgpack.packb([5, "", {"value": 5}, []]),
        msgpack.packb(["result", "", 5, []]),
        msgpack.packb(["result", "Other", {}, ["data"]]),
        msgpack.packb(["result", "object", {}, []]),
        msgpack.packb(["result", "Encoded", {"size": 5, "details": {}}, []]),
        msgpack.packb(["result", "Encoded", {"data": 5, "size": 5, "details": {}}, []]),
        msgpack.packb(["result", "Encoded", {"size": "x", "details": {}}, ["data"]]),
        msgpack.packb(["result", "Encoded", {"size": 5, "details": 1}, ["data"]]),
        msgpack.packb(["result", "Encoded", {"size": 5, "details": {}, "data": b""}, ["data"]]),
        msgpack.packb(["result", "Encoded", {"size": 5, "details": {}}, ["data"] * 9_000]),
        bytes(2_000),
    ],
)
def test_malformed_message_is_rejected(head: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(worker_message, "MAX_VALUES_BYTES", 100_000)
    receiver, sender = Pipe()
    sender.send_bytes(head)
    sender.send_bytes(b"bulk")
    sender.close()
    with pytest.raises(InvalidWorkerMessage):
        receive_message(receiver, [Encoded])


def test_size_of_messages_is_bounded_on_both_sides(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(worker_message, "MAX_VALUES_BYTES", 1_000)
    monkeypatch.setattr(worker_message, "MAX_BULK_BYTES", 1_000)
    for value in ("x" * 1_001, b"x" * 1_001):
        receiver, sender = Pipe()
        with pytest.raises(ValueError, match="too many"):
            send_message(sender, "result", value)
        sender.send_bytes(msgpack.packb(["result", "", {}, ["value"]]) if isinstance(value, bytes) else value.encode())
        sender.send_bytes(bytes(1_001))
        with pytest.raises(InvalidWorkerMessage):
            receive_message(receiver, [])


def test_ended_worker_is_the_end_of_file() -> None:
    receiver, sender = Pipe()
    sender.close()
    with pytest.raises(EOFError):
        receive_message(receiver, [])
