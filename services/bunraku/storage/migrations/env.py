"""What Alembic runs to migrate: on the connection that `bunraku.storage.migration` gives, in its transaction."""

from alembic import context

context.configure(connection=context.config.attributes["connection"])
with context.begin_transaction():
    context.run_migrations()
