"""Message bus, key-value store and leases, in process or over NATS."""
