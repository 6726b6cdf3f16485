"""Alembic environment: migrate on the connection and in the transaction of `bunraku.storage.migration`."""

from alembic import context

context.configure(connection=context.config.attributes["connection"])
with context.begin_transaction():
    context.run_migrations()
