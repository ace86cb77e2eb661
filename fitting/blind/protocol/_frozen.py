"""What is frozen before a sealed bank is drawn: the code that is examined, and a secret."""

import hashlib
from collections.abc import Iterable
from pathlib import Path

PACKAGES = ("fitting", "rapi_jax")


def tree_sha256(roots: Iterable[Path] | None = None) -> str:
    """SHA-256 over the paths and contents of all Python files of the installed packages.

    Over `rapi_jax` and `fitting`, that is, and the calibration: whatever a diagnosis computes with,
    the versions of other packages apart. Each path is relative and comes with its length and its
    file's, so that no two trees have one hash. `roots`: folders of packages, by default where these
    are installed.
    """
    home = Path(__file__).resolve().parents[3]
    roots = [home / name for name in PACKAGES] if roots is None else list(roots)
    found = {}
    for root in roots:
        for path in (*root.rglob("*.py"), *root.rglob("calibration.json")):
            found[path.relative_to(root.parent).as_posix()] = path
    digest = hashlib.sha256()
    for name in sorted(found):
        content = found[name].read_bytes()
        digest.update(f"{len(name.encode())} {name} {len(content)}\n".encode())
        digest.update(content)
    return digest.hexdigest()


def sealed_seed(tree: str, secret: bytes) -> int:
    """The seed of a sealed bank: SHA-256 of the tree's hash (bytes) and the secret, as an integer.

    Whoever froze the code could not choose the devices, for the secret was published by its hash
    first; nor can the code be changed to suit them, for then they are others.
    """
    return int.from_bytes(hashlib.sha256(bytes.fromhex(tree) + secret).digest(), "big")
