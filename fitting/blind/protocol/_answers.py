"""Answers, and commitments to them: SHA-256 over the answer's bytes and 32 bytes of salt.

A commitment binds whoever publishes it to the answer, and with the salt unknown tells nothing of
it. Salts are HMAC-SHA256 of a recording's name under the bank's secret, so that a bank whose making
was interrupted goes on to the same bytes.
"""

import dataclasses
import hashlib
import hmac
import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from rapi_jax import DataError
from rapi_jax.io import printable, write_atomic

from ._folder import BankFolder, json_bytes

if TYPE_CHECKING:
    from fitting.blind.simulator._bank import Spec
    from fitting.blind.simulator._simulated_device import SimulatedDevice

SALT_BYTES = 32
SPEC = ("seed", "kind", "effect", "sigma", "base_misfit", "any_session", "hysteresis")


def answer_record(spec: "Spec", device: "SimulatedDevice", recording_sha256: str) -> dict[str, Any]:
    """What is withheld of a device: what was asked for, and what was achieved.

    `recording_sha256` binds the recording to the answer.
    """
    return {
        **dataclasses.asdict(spec),
        "name": device.name,
        "truth": list(device.truth),
        "asked": device.requested_size,
        "size": device.size,
        "alone": list(device.single_sizes),
        "parameters": device.parameters,
        "noise_ghz": device.noise.rms,
        "recording_sha256": recording_sha256,
    }


def answer_bytes(value: dict[str, Any]) -> bytes:
    """The answer as it is committed to and stored."""
    return json_bytes(json.loads(json.dumps(value, default=_to_builtin)))


def answer_salt(secret: bytes, name: str) -> bytes:
    """The salt of one recording's answer."""
    return hmac.digest(secret, name.encode(), "sha256")


def commitment(content: bytes, salt: bytes) -> str:
    """SHA-256 of the answer's bytes and the salt, in hexadecimal."""
    if len(salt) != SALT_BYTES:
        raise ValueError(f"Argument `salt` must be {SALT_BYTES} bytes, but has {len(salt)}.")
    return hashlib.sha256(content + salt).hexdigest()


def matches_commitment(promised: str, content: bytes, salt: bytes) -> bool:
    """Whether answer and salt are those that were committed to."""
    return len(salt) == SALT_BYTES and hmac.compare_digest(commitment(content, salt), promised)


def write_answer(folder: BankFolder, value: dict[str, Any], secret: bytes) -> None:
    """Write answer and salt; the answer last, so that it tells that both are there."""
    name = value["name"]
    write_atomic(folder.answers / f"{name}.salt", answer_salt(secret, name))
    write_atomic(folder.answers / f"{name}.json", answer_bytes(value))


def read_answer(folder: BankFolder, name: str) -> tuple[dict[str, Any], str]:
    """An answer and its commitment, as the files are now. Raises `DataError`."""
    content, salt = _bytes(folder, f"{name}.json"), _bytes(folder, f"{name}.salt")
    try:
        value = json.loads(content)
        promised = commitment(content, salt)
        if not isinstance(value, dict) or value.get("name") != name:
            raise ValueError("of another recording")
    except (ValueError, RecursionError) as error:
        raise DataError(
            f"{printable(folder.answers / name)}: answer or salt is not what was written "
            f"({printable(error)}). Restore both, or make the bank again."
        ) from error
    return value, promised


def reveal(folder: BankFolder) -> list[dict[str, Any]]:
    """All answers in the bank's order. Raises `DataError` where one is not what was promised."""
    answers = []
    for name, _ in folder.entries:
        value, found = read_answer(folder, name)
        if not hmac.compare_digest(found, folder.manifest["commitments"][name]):
            raise DataError(
                f"{printable(folder.answers / name)}: answer and salt do not match the commitment "
                "in bank.json, so one of them was changed. Nothing can be scored."
            )
        answers.append(value)
    return answers


def read_spec(value: Mapping[str, Any]) -> "Spec":
    """What was asked for, from which the device can be drawn again."""
    from fitting.blind.simulator._bank import Spec

    return Spec(**{key: value[key] for key in SPEC})


def _bytes(folder: BankFolder, file: str) -> bytes:
    path = folder.answers / file
    try:
        return path.read_bytes()
    except FileNotFoundError:
        raise DataError(f"{printable(path)}: no such file. Restore it.") from None


def _to_builtin(value: Any) -> Any:
    """NumPy scalars and arrays as plain numbers and lists."""
    return value.tolist()
