"""Messages from a worker process to the service that runs it.

A worker reads files of strangers, which may take control of it: its messages are plain values of bounded size, checked
like input of a client. They are never pickled, as unpickling runs code.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Collection
from multiprocessing.connection import Connection
from typing import Any

import msgpack
from pydantic import TypeAdapter

MAX_VALUES_BYTES = 1 << 20
"""Maximum size of all values of a message together, except byte strings."""
MAX_BULK_BYTES = 256 << 20
"""Maximum size of one byte string."""


class InvalidWorkerMessage(Exception):
    """A message that no intact worker sends."""


def send_message(sender: Connection, kind: str, value: object) -> None:
    """Send a plain value, a byte string or a dataclass of these. Raise ValueError if it is too large."""
    is_record = dataclasses.is_dataclass(value)
    fields: dict[str, Any] = (
        {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}  # type: ignore[arg-type]
        if is_record
        else {"value": value}
    )
    bulk = {name: field for name, field in fields.items() if isinstance(field, bytes)}
    plain = {name: field for name, field in fields.items() if name not in bulk}
    head = msgpack.packb([kind, type(value).__name__ if is_record else "", plain, list(bulk)])
    if len(head) > MAX_VALUES_BYTES or any(len(data) > MAX_BULK_BYTES for data in bulk.values()):
        raise ValueError(f"the result of a worker has {len(head)} and {[*map(len, bulk.values())]} bytes, too many")
    sender.send_bytes(head)
    for data in bulk.values():
        sender.send_bytes(data)


def receive_message(receiver: Connection, records: Collection[type]) -> tuple[str, Any]:
    """Return the kind and the value of a message; it blocks. A dataclass must be one of `records`.

    Raise EOFError if the worker has ended, or `InvalidWorkerMessage`.
    """
    try:
        kind, record, fields, bulk = msgpack.unpackb(receiver.recv_bytes(MAX_VALUES_BYTES))
        names = [*fields, *bulk]
        if not isinstance(kind, str) or len(set(names)) != len(names):
            raise ValueError("a field is repeated")
        for name in bulk:
            fields[name] = receiver.recv_bytes(MAX_BULK_BYTES)
        if not record:
            return kind, fields["value"]
        found = next(one for one in records if one.__name__ == record)
        return kind, TypeAdapter(found).validate_python(fields)
    except EOFError:
        raise
    except (ValueError, TypeError, LookupError, StopIteration, OSError) as error:
        raise InvalidWorkerMessage(f"invalid message of a worker process: {type(error).__name__}") from error
