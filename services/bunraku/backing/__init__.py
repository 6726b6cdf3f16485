"""I/O: what the services stand on."""
