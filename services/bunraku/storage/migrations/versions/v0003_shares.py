"""Table of viewer links; subject and size of motions, for quotas."""

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0002"


def upgrade() -> None:
    """Create the table and add the columns."""
    op.create_table(
        "shares",
        sa.Column("id", sa.String(32), primary_key=True),
        sa.Column("created", sa.BigInteger, nullable=False),
        sa.Column("expires", sa.BigInteger, nullable=False),
        sa.Column("subject", sa.String(64), nullable=False),
        sa.Column("session", sa.String(64), nullable=True),
        sa.Column("motion", sa.String(64), nullable=True),
    )
    op.create_index("ix_shares_created", "shares", ["created"])
    op.add_column("motions", sa.Column("subject", sa.String(64), nullable=True))
    op.add_column("motions", sa.Column("bytes", sa.BigInteger, nullable=True))
    op.create_index("ix_motions_subject", "motions", ["subject"])
