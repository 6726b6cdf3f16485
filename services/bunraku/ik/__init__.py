"""The service that gives arm tables and solves limbs."""
