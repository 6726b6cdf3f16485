"""TLS of connections to backends: verified contexts, and errors with a remedy."""

from __future__ import annotations

import ssl
from pathlib import Path

_EXPIRED, _NOT_YET_VALID, _REVOKED = 10, 9, 23
_UNTRUSTED_CODES = frozenset({2, 18, 19, 20, 21, 24})
_WRONG_HOST_CODES = frozenset({62, 64})
"""Results of X509_verify_cert (OpenSSL, x509_vfy.h)."""
_PLAIN_TEXT_REASONS = frozenset(
    {"WRONG_VERSION_NUMBER", "RECORD_LAYER_FAILURE", "HTTP_REQUEST", "PACKET_LENGTH_TOO_LONG"}
)
_OLD_VERSION_REASONS = frozenset({"UNSUPPORTED_PROTOCOL", "TLSV1_ALERT_PROTOCOL_VERSION", "NO_PROTOCOLS_AVAILABLE"})


def create_client_context(ca: str = "", certificate: str = "", key: str = "") -> ssl.SSLContext:
    """Return a context for TLS 1.2 or newer that verifies the certificate and the host name of the server.

    `ca` is a PEM file with the trusted certificates; empty: those of the system. `certificate` and `key` are PEM files
    that identify this client to a server that asks for it. Raise ConnectionError if a file is missing or invalid.
    Call it in a thread: loading the certificates of the system takes tens of milliseconds.
    """
    for path in filter(None, (ca, certificate, key)):
        require_readable(path)
    try:
        context = ssl.create_default_context(cafile=ca or None)
    except ssl.SSLError:
        raise ConnectionError(f"{ca} holds no certificate in PEM format") from None
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    if certificate:
        try:
            # without a password, OpenSSL would ask for the one of an encrypted key on the terminal
            context.load_cert_chain(certificate, key or None, password="")
        except (ssl.SSLError, ValueError):
            name = f"{certificate} and {key}" if key else certificate
            raise ConnectionError(f"{name} are not a certificate and its unencrypted key in PEM format") from None
    return context


def require_readable(path: str) -> None:
    """Raise ConnectionError with the name of a file that cannot be read; errors of OpenSSL do not name it."""
    try:
        with Path(path).open("rb"):
            pass
    except OSError as error:
        raise ConnectionError(f"cannot read {path}: {error.strerror}") from None


def describe_tls_error(error: OSError, host: str) -> str:
    """Return the cause of a failed TLS handshake with the server at `host`, and the remedy."""
    if isinstance(error, ssl.SSLCertVerificationError):
        return _describe_verification_error(error, host)
    reason = getattr(error, "reason", None) or ""
    if reason in _PLAIN_TEXT_REASONS:
        return f"{host} does not speak TLS here: enable TLS on the server, or correct the port"
    if reason in _OLD_VERSION_REASONS:
        return f"{host} offers only TLS versions before 1.2: upgrade the server"
    if "CERTIFICATE_REQUIRED" in reason or "HANDSHAKE_FAILURE" in reason:
        return f"{host} refuses the TLS handshake: it may ask for a certificate of this client"
    if "UNKNOWN_CA" in reason or "BAD_CERTIFICATE" in reason:
        return f"{host} does not trust the certificate of this client"
    if isinstance(error, ssl.SSLError):
        return f"TLS with {host} failed: {reason or error}"
    return f"{host} closed the connection during the TLS handshake"


def _describe_verification_error(error: ssl.SSLCertVerificationError, host: str) -> str:
    code = error.verify_code
    if code == _EXPIRED:
        return f"the certificate of {host} has expired: renew it"
    if code == _NOT_YET_VALID:
        return f"the certificate of {host} is not valid yet: check the clocks of both machines"
    if code == _REVOKED:
        return f"the certificate of {host} was revoked: replace it"
    if code in _WRONG_HOST_CODES:
        return f"the certificate of {host} is for another host: connect by a name that it contains, or replace it"
    if code in _UNTRUSTED_CODES:
        return f"the certificate of {host} is not signed by a trusted authority: name the file of its authority"
    return f"the certificate of {host} is rejected: {error.verify_message}"
