"""The Python SDK: upload, list, watch, pull."""
