"""Live performers of stages: casts, connections, and the poses that viewers see."""
