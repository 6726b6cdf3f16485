"""Work of ingest jobs, run in a process of its own: one module per operation."""
