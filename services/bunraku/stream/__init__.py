"""The service that viewers watch: the only fan-out."""
