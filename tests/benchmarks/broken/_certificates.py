"""Certificates: of an operator, of drives, of the files of a result."""

from ._mutation import Mutation

_CERTIFICATE = "rapi_jax/inversion/certificate/_certificate.py"
_CERTIFY = "rapi_jax/inversion/certificate/_certify.py"
_FAILURES = "rapi_jax/inversion/certificate/_failures.py"
_SLOPES = "rapi_jax/inversion/certificate/_slopes.py"
_PROOFS = "tests/rapi_jax/inversion/test_certificate.py"
_BENT = "tests/rapi_jax/inversion/test_bent_certificate.py"
_FILES = "fitting/_result_files.py"
_BELONGS = "tests/fitting/test_belongs.py"

CERTIFICATES = (
    Mutation(
        "certificate: the slope of the wrong direction",
        _SLOPES,
        '    reached = key >= pieces.low if direction == "up" else key <= pieces.high',
        '    reached = key <= pieces.low if direction == "up" else key >= pieces.high',
        _PROOFS,
    ),
    Mutation(
        "certificate: falling drives are not looked at",
        _CERTIFY,
        '[smallest_slopes(pieces, gain, direction) for direction in ("up", "down")]',
        '[smallest_slopes(pieces, gain, direction) for direction in ("up", "up")]',
        _PROOFS,
    ),
    Mutation(
        "certificate: slopes at the ends of a stretch alone",
        _SLOPES,
        "np.stack([*ends, *np.clip(_flat(gain, tilts), low, high)])",
        "np.stack(ends)",
        _PROOFS,
    ),
    Mutation(
        "certificate: a slope of zero has an inverse",
        _FAILURES,
        "np.flatnonzero(least <= margin)",
        "np.flatnonzero(least < -margin)",
        _PROOFS,
    ),
    Mutation(
        "certificate: no refusal",
        _CERTIFICATE,
        "        if not self.invertible:\n",
        "        if False:\n",
        _PROOFS,
    ),
    Mutation(
        "certificate: a falling bound that turns over at one end alone",
        _CERTIFY,
        "(ends <= 0).any(axis=0)",
        "(ends <= 0).all(axis=0)",
        _BENT,
    ),
    Mutation(
        "certificate: parameters that are no number",
        _CERTIFY,
        "    if not all(np.isfinite(x).all() for x in numbers):\n",
        "    if False:\n",
        _PROOFS,
    ),
    Mutation(
        "certificate: joined stretches end where the first does",
        _FAILURES,
        "low=last.low, high=new.high)",
        "low=last.low, high=last.high)",
        _PROOFS,
    ),
    Mutation(
        "result: a file of another result belongs",
        _FILES,
        "        if wanted != hash_files([path])[path.name]:\n",
        "        if False:\n",
        _BELONGS,
    ),
    Mutation(
        "result: a file of an earlier result belongs",
        _FILES,
        "        if wanted is None:\n",
        "        if False and wanted is None:\n",
        _BELONGS,
    ),
    Mutation(
        "result: what was not finished is finished",
        _FILES,
        "        if schema == UNFINISHED:\n",
        "        if False:\n",
        _BELONGS,
    ),
    Mutation(
        "result: a drive that no certificate lists",
        _FILES,
        "    if _is_drive(path.name) and drives and path.name not in drives:\n",
        "    if False:\n",
        _BELONGS,
    ),
    Mutation(
        "certificate of drives: any file beside it is one of its drives",
        "fitting/claim_check/_certificate.py",
        "        check_belongs(drive)\n",
        "",
        _BELONGS,
    ),
)
