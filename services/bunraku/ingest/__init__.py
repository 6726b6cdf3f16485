"""The service that takes files and makes motions of them."""
