"""Catalogue (SQL), jobs, share links and the object store of motions."""
