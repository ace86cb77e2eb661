"""The certificate of drives, as `rapi compensate` wrote it, and the drives that it lists."""

import json
from pathlib import Path
from typing import Any

from fitting._result_files import UNFINISHED, check_belongs
from fitting.identification.assessment._claim import Claim
from rapi_jax import DataError
from rapi_jax.internal import inside, read_text
from rapi_jax.io import printable, read_drive

from ._scan import CertifiedDrive

CERTIFICATE, SCHEMA = "certificate.json", "rapi.compensation/1"
_LIMIT = 64 * 2**20  # bytes
_NO_CLAIM = "the model that the drives were made with carries no claim"


def read_certificate(path: Path) -> tuple[list[CertifiedDrive], Claim | None, dict[str, Any]]:
    """The drives of a certificate, the claim of the model they were made with, and its content.

    The claim is `None` where the certificate has none; the content says why in `unclaimed`. Raises
    `DataError` where the file is no certificate or a drive beside it belongs to another one.
    """
    label = printable(path)
    damaged = (
        f"{label}: not a certificate of `rapi compensate`, or damaged. Write the drives again."
    )
    try:
        content = json.loads(read_text(path, _LIMIT))
        schema = str(content["schema"])
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise DataError(damaged) from error
    if schema == UNFINISHED:
        raise DataError(f"{label}: the drives were not all written. Write them again.")
    if schema != SCHEMA:
        raise DataError(f"{label}: schema {printable(schema)}, not {SCHEMA}.")
    try:
        rows = [
            (str(row["file"]), row.get("nonlinearity") or {}, [str(n) for n in row["notes"]])
            for row in content["drives"]
        ]
        spans = [
            None if one.get("span") is None else float(one["span"]) for one in content["drives"]
        ]
        own = [(float(one.get("up", 0.0)), float(one.get("down", 0.0))) for _, one, _ in rows]
        units = str(content["unit"]), str(content["drive_unit"])
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise DataError(damaged) from error
    claim = content.get("claim")
    drives = []
    for (file, _, notes), (up, down), span in zip(rows, own, spans, strict=True):
        drive = inside(path.parent, file)
        check_belongs(drive)
        drives.append(CertifiedDrive(read_drive(drive), (up, down), tuple(notes), span))
    return drives, None if claim is None else Claim.from_dict(claim), {
        "response_unit": units[0], "drive_unit": units[1],
        "unclaimed": printable(content.get("unclaimed") or _NO_CLAIM, 1000),
    }  # fmt: skip
