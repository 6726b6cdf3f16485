"""Header that authorizes requests."""

from __future__ import annotations


def authorization(token: str | None) -> dict[str, str]:
    """Return the `Authorization` header of a token, or no header without one."""
    return {} if token is None else {"Authorization": f"Bearer {token}"}
