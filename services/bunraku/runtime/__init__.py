"""Settings, clock, logging, metrics, readiness and the service context."""
