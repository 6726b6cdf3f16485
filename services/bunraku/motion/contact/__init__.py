"""Contacts of a performer with its surroundings."""
