"""Library of props."""
