"""The service that holds the stage: timeline, puppeteers, merge."""
