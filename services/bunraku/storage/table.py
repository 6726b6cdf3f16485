"""Tables of the catalogue and the interface that runs their queries."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from typing import Any, Protocol, TypeVar

from sqlalchemy import BigInteger, Column, Integer, LargeBinary, MetaData, String, Table, Text

METADATA = MetaData()
MOTIONS = Table(
    "motions",
    METADATA,
    Column("id", String(32), primary_key=True),
    Column("created", BigInteger, nullable=False, index=True),
    Column("description", Text, nullable=False),
    Column("subject", String(64), nullable=True, index=True),
    Column("bytes", BigInteger, nullable=True),
    Column("folded_name", Text, nullable=True),
    Column("folded_tags", Text, nullable=True),
)
JOBS = Table(
    "jobs",
    METADATA,
    Column("id", String(64), primary_key=True),
    Column("created", BigInteger, nullable=False),
    Column("details", Text, nullable=False),
    Column("holder", String(32), nullable=False),
    Column("until", BigInteger, nullable=False),
    Column("tries", Integer, nullable=False),
)
SHARES = Table(
    "shares",
    METADATA,
    Column("id", String(32), primary_key=True),
    Column("created", BigInteger, nullable=False, index=True),
    Column("expires", BigInteger, nullable=False),
    Column("subject", String(64), nullable=False),
    Column("session", String(64), nullable=True),
    Column("motion", String(64), nullable=True),
)
PROPS = Table(
    "props",
    METADATA,
    Column("id", String(32), primary_key=True),
    Column("created", BigInteger, nullable=False, index=True),
    Column("subject", String(64), nullable=False, index=True),
    Column("description", Text, nullable=False),
    Column("model", LargeBinary, nullable=False),
)

Result = TypeVar("Result")


class QueryRunner(Protocol):
    """Function that runs a query with the time limit and error handling of the database."""

    def __call__(self, query: Coroutine[Any, Any, Result]) -> Coroutine[Any, Any, Result]:
        """Return the result; raise `BackendUnavailable`, or `ProblemError` (507) if the database's disk is full."""


class RemovalRunner(Protocol):
    """Function that runs a query which removes rows, if the disk is full in reserved space."""

    def __call__(self, create_query: Callable[[], Coroutine[Any, Any, Result]]) -> Coroutine[Any, Any, Result]:
        """Return the result; `create_query` may be called twice. Raise as `QueryRunner` does."""
