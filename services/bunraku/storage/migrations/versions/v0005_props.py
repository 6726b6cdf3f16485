"""Table of props."""

import sqlalchemy as sa
from alembic import op

revision = "0005"
down_revision = "0004"


def upgrade() -> None:
    """Create the table."""
    op.create_table(
        "props",
        sa.Column("id", sa.String(32), primary_key=True),
        sa.Column("created", sa.BigInteger, nullable=False),
        sa.Column("subject", sa.String(64), nullable=False),
        sa.Column("description", sa.Text, nullable=False),
        sa.Column("model", sa.LargeBinary, nullable=False),
    )
    op.create_index("ix_props_created", "props", ["created"])
    op.create_index("ix_props_subject", "props", ["subject"])
