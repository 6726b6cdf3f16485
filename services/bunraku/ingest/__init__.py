"""Ingest service: uploads, encoding jobs, derived motions and recordings."""
