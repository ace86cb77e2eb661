"""Results of each kind that one writes over another, and what a folder of them holds when read.

A folder is whole where all that is accepted from it is of one result, and what is not is refused in
one line that names the file.
"""

import dataclasses
import tempfile
from collections.abc import Callable
from pathlib import Path

from fitting import Claim, FitResult, fit
from fitting._result_files import UNFINISHED, check_belongs, hash_files
from fitting.claim_check._certificate import read_certificate
from fitting.commands.shared._model import load_model
from fitting.commands.shared.files._certificate_report import certificate_report
from fitting.commands.shared.files._drive_files import generator_waveforms, write_drives
from fitting.diagnosis._diagnosis import Diagnosis, Verdict
from rapi_jax import DataError, Identified, ModelError, compensate, linear_scan
from tests.support import diagnoses
from tests.support.spoiled import healthy

Writer = Callable[[Path], object]
CLAIM = Claim(0.02, 0.018, 0.022, 0.02, 5.0, (10.0, 40.0), (4.5, 4.5), 0.01, runs=4)


@dataclasses.dataclass(frozen=True)
class Kind:
    """Two results of a kind: their writers, and the name of their list.

    `read`: what commands read a file with. `hashes`: of the files of each, by name.
    """

    writers: tuple[Writer, Writer]
    table: str
    read: Callable[[Path], object]
    hashes: tuple[dict[str, str | None], dict[str, str | None]]

    @classmethod
    def of(cls, writers: tuple[Writer, Writer], table: str, read: Callable[[Path], object]):
        """With the hashes of what the writers write into folders of their own."""
        hashes = []
        for write in writers:
            with tempfile.TemporaryDirectory() as folder:
                write(Path(folder))
                hashes.append(hash_files(Path(folder).iterdir()))
        return cls(writers, table, read, (hashes[0], hashes[1]))

    def outcome(self, folder: Path) -> str:
        """`first`, `second`, `refused` or `empty`; else, after `TORN`, what is wrong."""
        accepted: dict[str, str] = {}
        refused = []
        for path in sorted(folder.iterdir()):
            if path.name.startswith(".tmp-"):
                continue
            try:
                self.read(path)
                check_belongs(path)
            except (DataError, ModelError) as error:
                refused.append(path.name)
                if "\n" in str(error) or path.name not in str(error):
                    return f"TORN: {path.name} is refused without its name: {error}"
                continue
            if path.name == self.table and UNFINISHED in path.read_text():
                refused.append(path.name)
            else:
                accepted[path.name] = self._origin(path)
        found = set(accepted.values())
        if len(found) > 1 or "neither" in found:
            return f"TORN: {accepted}"
        if not found:
            return "refused" if refused else "empty"
        (one,) = found
        missing = self.hashes[("first", "second").index(one)].keys() - accepted.keys()
        return f"TORN: {one} without {missing}" if missing else one

    def _origin(self, path: Path) -> str:
        """Which result a file is of. A list may name files of an earlier result, too."""
        (found,) = hash_files([path]).values()
        for name, hashes in zip(("first", "second"), self.hashes, strict=True):
            if hashes.get(path.name) == found:
                return name
        if path.name == self.table:  # with what an earlier result has left
            text = path.read_text()
            return "second" if all(mark in text for mark in MARKS) else "neither"
        return "neither"


MARKS = ('"data_sha256": "66"', '"drive_20Hz.csv": null')


def fits() -> Kind:
    """Two fits; read as `predict`, `compensate` and `diagnose` read a model."""
    results = [_fit(seed) for seed in (81, 82)]
    return Kind.of(
        (lambda f: results[0].save(f, plots=False), lambda f: results[1].save(f, plots=False)),
        "model.json",
        _read_model,
    )


def diagnosed() -> Kind:
    """Two diagnoses, their content written by hand; the page is as large as a real one."""
    results = [_diagnosis(_fit(seed)) for seed in (81, 82)]
    return Kind.of((results[0].save, results[1].save), "diagnosis.json", _read_model)


def compensations() -> Kind:
    """Drives at two rates, then at one; read as `measure` and `fit --check` read them."""
    result = _fit(81)
    return Kind.of(
        (_drives(result, (10.0, 20.0), 60.0), _drives(result, (10.0,), 66.0)),
        "certificate.json",
        lambda path: read_certificate(path) if path.name == "certificate.json" else None,
    )


KINDS = {"fit": fits, "diagnose": diagnosed, "compensate": compensations}


def _fit(seed: int) -> FitResult:
    columns = healthy(seed)
    return fit(columns.device, columns.recording(), starts=2, guess=False)


def _diagnosis(result: FitResult) -> Diagnosis:
    content = diagnoses.creep()
    said = content.pop("verdict")
    verdict = Verdict(
        said["name"],
        said["name"],
        tuple(said["effects"]),
        0.9,
        tuple(said["set"]),
        said["reason"],
        "",
        "",
    )
    content.setdefault("faults", [])
    return Diagnosis(result.recording, result.ecdl, result.ecdl, verdict, content, (), 1.0)


def _drives(result: FitResult, rates: tuple[float, ...], span: float) -> Writer:
    seen = Identified.of(result.recording)
    targets = linear_scan(rates, span=span, samples=512)
    made = [compensate(result.ecdl, target, identified=seen) for target in targets]
    about = {
        "response_unit": "GHz", "drive_unit": "V", "trusted": True, "data_sha256": f"{span:g}",
        "claim": dataclasses.asdict(CLAIM) | {"unit": "GHz"},
    }  # fmt: skip
    report = certificate_report(made, about, seen, None, None, result.ecdl)
    return lambda folder: write_drives(
        folder,
        made,
        about,
        dict(report),
        None,
        False,
        generator_waveforms([one.drive for one in made], "V", seen.limits()),
    )


def _read_model(path: Path) -> None:
    """As the commands do, where a model is named."""
    if path.suffix == ".rapi":
        load_model(path)
