"""What Alembic runs to migrate: on the connection that `bunraku.backing.migrate` gives, in its transaction."""

from alembic import context

context.configure(connection=context.config.attributes["connection"])
with context.begin_transaction():
    context.run_migrations()
