"""Folded name and tags of motions, for searches."""

import json

import sqlalchemy as sa
from alembic import op

from bunraku.storage.search_text import search_columns

revision = "0004"
down_revision = "0003"

_CHUNK_ROWS = 500


def upgrade() -> None:
    """Add the columns and fill them. They stay empty in rows that a replica of an older release adds meanwhile."""
    op.add_column("motions", sa.Column("folded_name", sa.Text, nullable=True))
    op.add_column("motions", sa.Column("folded_tags", sa.Text, nullable=True))
    motions = sa.table("motions", *(sa.column(name) for name in ("id", "description", "folded_name", "folded_tags")))
    fill = (
        sa.update(motions)
        .where(motions.c.id == sa.bindparam("row"))
        .values(folded_name=sa.bindparam("name"), folded_tags=sa.bindparam("tags"))
    )
    connection, after = op.get_bind(), ""
    statement = sa.select(motions.c.id, motions.c.description).order_by(motions.c.id).limit(_CHUNK_ROWS)
    while rows := connection.execute(statement.where(motions.c.id > after)).all():
        after = rows[-1].id
        columns = [search_columns(json.loads(row.description)) for row in rows]
        connection.execute(
            fill,
            [
                {"row": row.id, "name": each["folded_name"], "tags": each["folded_tags"]}
                for row, each in zip(rows, columns, strict=True)
            ],
        )
