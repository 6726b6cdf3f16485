"""Work of ingest jobs in separate processes, one module per operation."""
