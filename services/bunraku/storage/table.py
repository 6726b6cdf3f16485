"""The catalogue's tables, and how they are asked."""

from __future__ import annotations

from collections.abc import Coroutine
from typing import Any, Protocol, TypeVar

from sqlalchemy import BigInteger, Column, Integer, MetaData, String, Table, Text

METADATA = MetaData()
MOTIONS = Table(
    "motions",
    METADATA,
    Column("id", String(32), primary_key=True),
    Column("created", BigInteger, nullable=False, index=True),
    Column("description", Text, nullable=False),
    Column("subject", String(64), nullable=True, index=True),
    Column("bytes", BigInteger, nullable=True),
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

Found = TypeVar("Found")


class QueryRunner(Protocol):
    """Waits for a database, as `SqlCatalogue` does."""

    def __call__(self, query: Coroutine[Any, Any, Found]) -> Coroutine[Any, Any, Found]:
        """What it answers; raises `Unavailable`, and `ProblemError` where its disk is full."""
