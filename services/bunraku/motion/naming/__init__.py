"""Names of joints: conventions, and the mapping of a source's joints by name or by shape."""
