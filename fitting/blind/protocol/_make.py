"""Making a bank: devices simulated, recorded and committed to; resumes where it stopped."""

import hashlib
from collections.abc import Callable
from typing import Any

from rapi_jax import DataError
from rapi_jax.io import OutputError, printable, read_recording

from ._answers import answer_record, answer_salt, read_answer, read_spec, write_answer
from ._exchange import to_recording, write_verified
from ._folder import SCHEMA, BankFolder, make_folder, refuse_unknown_files, write_json
from ._frozen import sealed_seed, tree_sha256
from ._sealed import committed_secret, draw_secret, read_secret
from ._tiers import SEEDS, BankEntry, bank_entries

Progress = Callable[[int, int, str], None]  # done, total, last name


def make_bank(
    folder: BankFolder,
    tier: str = "open",
    *,
    count: int = 200,
    seed: int | None = None,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Make the bank, or what is missing of it, and return `bank.json`.

    `seed`: by default the tier's own; a sealed bank's comes from the frozen code and its secret.
    What is there and whole is kept. Raises `OutputError` where the folder holds anything else, and
    `DataError` where a part was changed, or a sealed bank has no commitment.
    """
    say = progress or (lambda done, total, name: None)
    refuse_unknown_files(folder.root)
    tree = tree_sha256()
    secret, seed = _secret_and_seed(folder, tier, seed, tree)
    drawn = bank_entries(tier, seed, count)
    names = {entry.name for entry in drawn}
    refuse_unknown_files(folder.recordings, names)
    files = {f"{name}{end}" for name in names for end in (".json", ".salt")}
    refuse_unknown_files(folder.answers, files | {"secret"})
    manifest = {
        "schema": SCHEMA,
        "tier": tier,
        "count": count,
        "recordings": [{"name": e.name, "withheld": e.withheld} for e in drawn],
        "seed_sha256": hashlib.sha256(str(seed).encode()).hexdigest(),
        "tree_sha256": tree,
        "secret_sha256": hashlib.sha256(secret).hexdigest(),
    }
    if folder.bank.exists():
        _check_same(folder, manifest)
    make_folder(folder.recordings)
    make_folder(folder.answers, private=True)
    commitments = {}
    say(0, count, "")
    for done, entry in enumerate(drawn, 1):
        commitments[entry.name] = _existing_commitment(folder, entry, secret) or _simulate_entry(
            folder, entry, secret
        )
        say(done, count, entry.name)
    if folder.bank.exists():
        if folder.manifest["commitments"] != commitments:
            raise DataError(
                f"{printable(folder.bank)}: commitments are not those of the answers, so either "
                "was changed. Make the bank again in another folder."
            )
        return folder.manifest
    from fitting._versions import package_versions

    write_json(folder.bank, manifest | {"commitments": commitments, "versions": package_versions()})
    return folder.manifest


def _secret_and_seed(
    folder: BankFolder, tier: str, seed: int | None, tree: str
) -> tuple[bytes, int]:
    if tier == "sealed":
        if seed is not None:
            raise DataError(
                "a sealed bank's seed comes from the frozen code and the secret: leave out --seed."
            )
        secret = committed_secret(folder)
        if folder.bank.exists():  # what is made stays as it was drawn
            tree = str(folder.manifest["tree_sha256"])
        return secret, sealed_seed(tree, secret)
    if folder.commitment.exists():
        raise OutputError(
            f"{printable(folder.root)} is committed to a sealed bank. Make it with --tier sealed, "
            "or choose another folder."
        )
    secret = read_secret(folder) if folder.secret.exists() else draw_secret(folder)
    return secret, SEEDS[tier] if seed is None else seed


def _check_same(folder: BankFolder, wanted: dict[str, Any]) -> None:
    """Refuse to go on in a finished bank of another kind."""
    manifest = folder.manifest
    for key in ("tier", "count", "recordings", "seed_sha256", "secret_sha256"):
        if manifest.get(key) != wanted[key]:
            raise OutputError(
                f"{printable(folder.root)} holds a finished bank of another {key.split('_')[0]}. "
                "Choose another folder."
            )


def _existing_commitment(folder: BankFolder, entry: BankEntry, secret: bytes) -> str | None:
    """The commitment of what is there already; `None` where it is not all there."""
    name = entry.name
    if not (folder.answers / f"{name}.json").exists():
        return None
    value, promised = read_answer(folder, name)
    recording = folder.recordings / name
    try:
        same = (
            read_spec(value) == entry.spec
            and (folder.answers / f"{name}.salt").read_bytes() == answer_salt(secret, name)
            and read_recording(recording).sha256() == value["recording_sha256"]
        )
    except (KeyError, TypeError):
        same = False
    if not same:
        raise DataError(
            f"{printable(recording)}: recording and answer are not those of this device, so one of "
            "them was changed. Make the bank again in another folder."
        )
    return promised


def _simulate_entry(folder: BankFolder, entry: BankEntry, secret: bytes) -> str:
    """Draw a device, write its recording, then its answer; return the commitment."""
    device = entry.spec.draw()
    recording = to_recording(device.runs)
    write_verified(recording, folder.recordings / entry.name)
    write_answer(folder, answer_record(entry.spec, device, recording.sha256()), secret)
    return read_answer(folder, entry.name)[1]
