"""Sealed banks: committed to before they are drawn, examined once by the code that was frozen."""

import datetime
import hashlib
import hmac
import secrets

from rapi_jax import DataError
from rapi_jax.io import OutputError, printable, write_atomic

from ._folder import BankFolder, make_folder, read_json, refuse_unknown_files, write_json
from ._frozen import sealed_seed, tree_sha256

SECRET_BYTES = 32


def utc_now() -> str:
    """The time in UTC."""
    return datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")


def commit_to_secret(folder: BankFolder) -> str:
    """Write a new secret, and its hash to publish; return the hash.

    Raises `OutputError` where the bank has one already: a second try would be a choice.
    """
    refuse_unknown_files(folder.root)
    if folder.commitment.exists() or folder.secret.exists() or folder.bank.exists():
        raise OutputError(
            f"{printable(folder.root)} is committed or made already, and a secret is drawn once. "
            "Choose another folder."
        )
    secret = draw_secret(folder)
    value = hashlib.sha256(secret).hexdigest()
    write_json(folder.commitment, {"secret_sha256": value, "written": utc_now()})
    return value


def draw_secret(folder: BankFolder) -> bytes:
    """Draw the bank's secret and write it for its owner alone."""
    make_folder(folder.root)
    make_folder(folder.answers, private=True)
    secret = secrets.token_bytes(SECRET_BYTES)
    write_atomic(folder.secret, secret)  # the folder is its owner's already
    folder.secret.chmod(0o600)
    return secret


def read_secret(folder: BankFolder) -> bytes:
    """The secret. Raises `DataError` where it is missing or not the one committed to."""
    try:
        secret = folder.secret.read_bytes()
    except FileNotFoundError:
        raise DataError(
            f"{printable(folder.root)}: no secret has been committed to. `rapi blind commit` "
            "writes one and prints the hash to publish."
        ) from None
    if len(secret) != SECRET_BYTES:
        raise DataError(f"{printable(folder.secret)}: not {SECRET_BYTES} bytes. Restore it.")
    return secret


def committed_secret(folder: BankFolder) -> bytes:
    """The secret of a sealed bank, checked against its published hash. Raises `DataError`."""
    secret = read_secret(folder)
    if not folder.commitment.exists():
        raise DataError(
            f"{printable(folder.root)}: a sealed bank needs a published commitment, but there is "
            "no commitment.json. Run `rapi blind commit` on a new folder first."
        )
    promised = str(read_json(folder.commitment).get("secret_sha256"))
    if not hmac.compare_digest(hashlib.sha256(secret).hexdigest(), promised):
        raise DataError(
            f"{printable(folder.commitment)}: not the hash of the secret in answers/, so one of "
            "them was changed. Commit anew in another folder."
        )
    return secret


def check_code(folder: BankFolder) -> None:
    """Raise `DataError` where a sealed bank meets other code than it was drawn for."""
    drawn = folder.manifest["tree_sha256"]
    tree = tree_sha256()
    if folder.sealed and tree != drawn:
        raise DataError(
            f"{printable(folder.root)}: sealed for the code of hash {drawn[:12]}, but this is "
            f"{tree[:12]}. Go back to that version; a new one needs a new sealed bank."
        )


def check_sealed_specs(folder: BankFolder, specs: list[object]) -> bytes:
    """Check that a sealed bank holds the devices its tree and secret give; return the secret."""
    from ._tiers import bank_entries

    manifest, secret = folder.manifest, committed_secret(folder)
    if hashlib.sha256(secret).hexdigest() != manifest["secret_sha256"]:
        raise DataError(f"{printable(folder.bank)}: of another secret. Nothing can be scored.")
    seed = sealed_seed(manifest["tree_sha256"], secret)
    drawn = bank_entries("sealed", seed, manifest["count"])
    if [entry.spec for entry in drawn] != specs:
        raise DataError(
            f"{printable(folder.bank)}: its devices are not those that tree and secret give, so "
            "they were chosen, or another version drew them. Nothing can be scored."
        )
    return secret
