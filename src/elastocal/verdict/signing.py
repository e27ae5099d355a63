"""Signatures by an ed25519 key (RFC 8032) of the journal of a run, or of a report.

A journal names its recordings, its plan and its cell by hash, so that its own hash covers the whole
record of a run. A report carries a manifest with the hash of every file that it shows. Hashes can
be renewed without a key; only a signature shows who confirmed them.
"""

import importlib.util
import json
import os
import re
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from elastocal.errors import FileAccessError, VerificationError
from elastocal.files import read_text
from elastocal.records import (
    read_json,
    record,
    require_written,
    to_data,
    write_json,
)

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

OF_RUN, OF_REPORT = "run", "report"
"""Objects of a signature."""
_KEY, _SIGNATURE = re.compile("[0-9a-f]{64}"), re.compile("[0-9a-f]{128}")
_SHOWN = 16
"""Number of digits of a public key that people compare."""


@record("elastocal.signature/1")
class Signature:
    """A signature of the SHA-256 of a run's journal, or of a report's manifest."""

    of: str
    """``run`` or ``report``: one is no signature of the other."""
    sha256: str
    """Hash of what is signed."""
    made: str
    """Date and time by the clock of who signed, ISO 8601, UTC."""
    key: str
    """The public key, 64 hexadecimal digits."""
    signature: str = ""
    """Signature of the other entries as JSON, keys sorted and without spaces; 128 hexadecimal
    digits."""

    @property
    def signed(self) -> bytes:
        """Signed bytes."""
        data = to_data(replace(self, signature=""))
        return json.dumps(data, sort_keys=True, separators=(",", ":")).encode()

    @property
    def signer(self) -> str:
        """Key in the form that people compare."""
        return self.key[:_SHOWN]


def make_key(path: Path) -> Path:
    """Make a key pair: the private key at a path, for its owner alone, the public one beside it.

    Parameters
    ----------
    path : Path
        File for the private key, PKCS #8 in PEM, not encrypted.

    Returns
    -------
    Path
        File of the public key: the same name with ``.pub`` behind it.

    Raises
    ------
    FileAccessError
        If a file is there already, or cannot be written.
    VerificationError
        If the package `cryptography` is not installed.
    """
    _require_cryptography()
    from cryptography.hazmat.primitives import serialization
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

    path, public = Path(path), Path(f"{path}.pub")
    key = Ed25519PrivateKey.generate()
    secret = key.private_bytes(
        serialization.Encoding.PEM,
        serialization.PrivateFormat.PKCS8,
        serialization.NoEncryption(),
    )
    known = key.public_key().public_bytes(
        serialization.Encoding.PEM, serialization.PublicFormat.SubjectPublicKeyInfo
    )
    if os.path.lexists(public):
        raise FileAccessError(f"{public} is there already: a key is never overwritten")
    _create(path, secret, 0o600)
    _create(public, known, 0o644)
    return public


def _create(path: Path, data: bytes, mode: int) -> None:
    """Write a file that is not there yet, with its permissions from its first byte on."""
    try:
        handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode)
        with os.fdopen(handle, "wb") as file:
            os.fchmod(handle, mode)
            file.write(data)
            file.flush()
            os.fsync(handle)
    except FileExistsError as error:
        raise FileAccessError(f"{path} is there already: a key is never overwritten") from error
    except OSError as error:
        raise FileAccessError(f"cannot write {path}: {error.strerror or error}") from error


def read_private_key(path: Path) -> "Ed25519PrivateKey":
    """Return the private key of a file.

    Raises
    ------
    VerificationError
        If it is no ed25519 key, is encrypted, or `cryptography` is not installed.
    FileAccessError
        If it cannot be read.
    """
    _require_cryptography()
    from cryptography.exceptions import UnsupportedAlgorithm
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
    from cryptography.hazmat.primitives.serialization import load_pem_private_key

    text = read_text(path)
    try:
        key = load_pem_private_key(text.encode(), password=None)
    except (ValueError, TypeError, UnsupportedAlgorithm) as error:
        raise VerificationError(
            f"{path} is no private key that is not encrypted (PEM); `elastocal verify --new-key`"
            " makes one"
        ) from error
    if not isinstance(key, Ed25519PrivateKey):
        raise VerificationError(f"{path} is no ed25519 key; `elastocal verify --new-key` makes one")
    return key


def read_public_key(path: Path) -> str:
    """Return the public key of a file as 64 hexadecimal digits.

    Raises
    ------
    VerificationError
        If it is no public ed25519 key, or `cryptography` is not installed.
    FileAccessError
        If it cannot be read.
    """
    _require_cryptography()
    from cryptography.exceptions import UnsupportedAlgorithm
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey
    from cryptography.hazmat.primitives.serialization import load_pem_public_key

    text = read_text(path)
    if "PRIVATE KEY" in text:
        raise VerificationError(f"{path} is a private key: --key takes the public one ({path}.pub)")
    try:
        key = load_pem_public_key(text.encode())
    except (ValueError, UnsupportedAlgorithm) as error:
        raise VerificationError(f"{path} is no public key (PEM)") from error
    if not isinstance(key, Ed25519PublicKey):
        raise VerificationError(f"{path} is no ed25519 key")
    return key.public_bytes_raw().hex()


def public_key(private: "Ed25519PrivateKey") -> str:
    """Return the public key of a private one, 64 hexadecimal digits."""
    return private.public_key().public_bytes_raw().hex()


def sign(private: "Ed25519PrivateKey", of: str, sha256: str, made: str) -> Signature:
    """Return the signature of a hash.

    Parameters
    ----------
    private : Ed25519PrivateKey
        See `read_private_key`.
    of : str
        `OF_RUN` or `OF_REPORT`.
    sha256 : str
        Hash of the journal, or of the manifest.
    made : str
        Date and time, ISO 8601, UTC.
    """
    unsigned = Signature(of, sha256, made, public_key(private))
    return replace(unsigned, signature=private.sign(unsigned.signed).hex())


def check_signature(found: Signature, of: str, sha256: str, trusted: str | None) -> None:
    """Refuse a signature that is not of a hash, or not by a key that is trusted.

    Parameters
    ----------
    found : Signature
        The signature.
    of, sha256 : str
        Expected object and hash.
    trusted : str or None
        Public key as `read_public_key` returns it; None: the one that the signature states.

    Raises
    ------
    VerificationError
        In one sentence, or if `cryptography` is not installed.
    """
    _require_cryptography()
    from cryptography.exceptions import InvalidSignature
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey

    if found.of != of:
        raise VerificationError(f"the signature is of a {found.of}, not of a {of}")
    if trusted is not None and found.key != trusted:
        raise VerificationError(
            f"the {of} is signed by another key ({found.signer}) than the one given"
            f" ({trusted[:_SHOWN]})"
        )
    try:
        # Python also reads capitals and spaces, so that one signature had many spellings.
        if not (_KEY.fullmatch(found.key) and _SIGNATURE.fullmatch(found.signature)):
            raise ValueError("not in hexadecimal digits")
        key = Ed25519PublicKey.from_public_bytes(bytes.fromhex(found.key))
        key.verify(bytes.fromhex(found.signature), found.signed)
    except (ValueError, InvalidSignature) as error:
        raise VerificationError(f"the signature of the {of} is not valid") from error
    if found.sha256 != sha256:
        raise VerificationError(f"the {of} was changed after it was signed")


def write_signature(path: Path, signature: Signature) -> None:
    """Write the signature of a run to its file.

    Raises
    ------
    FileAccessError
        If it cannot be written.
    """
    write_json(path, signature)


def read_signature(path: Path) -> Signature:
    """Return the signature in a file.

    Raises
    ------
    SchemaError
        If it is invalid, or differs from the written form in a space, key or letter.
    FileAccessError
        If it cannot be read.
    """
    found = read_json(path, Signature)
    require_written(path, to_data(found))
    return found


def _require_cryptography() -> None:
    """Refuse to go on without the package, which is an extra.

    Raises
    ------
    VerificationError
        If it is not installed.
    """
    if importlib.util.find_spec("cryptography") is None:
        raise VerificationError(
            "signatures need the package cryptography, which is not installed: pip install"
            " 'elastocal[sign]'"
        )
