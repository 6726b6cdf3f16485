"""Makes the golden vectors of `proto/vectors`, by which both languages are judged."""
