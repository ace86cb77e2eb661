"""Files that are damaged, or made to do harm, are refused in one line."""

import pickle
import random
import zipfile

import h5py
import numpy as np
import pytest
from mutations import mutated as mutated_bytes
from mutations import trials
from scope_files import MAKERS, scanned

from rapi_jax import DataError
from rapi_jax.io import ImportOptions, import_recording


class Harm:
    """An object whose unpickling would do something."""

    def __reduce__(self):
        return (pytest.fail, ("unpickled",))


def pickled_npy(path):
    np.save(path, np.array([Harm(), Harm()], dtype=object), allow_pickle=True)


def pickled_npz(path):
    with path.open("wb") as file:
        np.savez(file, drive=np.array([Harm()], dtype=object))


def a_pickle(path):
    path.write_bytes(pickle.dumps({"a": 1}))


def bomb(path):
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("a.npy", b"")
        archive.infolist()[0].file_size = 2**40


def external(path):
    with h5py.File(path, "w") as file:
        file["u"] = np.arange(9.0)
        file["y"] = h5py.ExternalLink("/etc/passwd", "/y")


def cut_mat(path):
    from scipy.io import savemat

    savemat(path, {"drive": np.arange(1000.0)})
    path.write_bytes(path.read_bytes()[:400])


def zipped(content: dict[str, str]):
    """Writes a ZIP archive that holds these files."""

    def write(path):
        with zipfile.ZipFile(path, "w") as archive:
            for name, text in content.items():
                archive.writestr(name, text)

    return write


FILES = {
    "pickled.npy": (pickled_npy, "never unpickled"),
    "photos.zip": (zipped({"a.txt": "1"}), "without arrays of NumPy (it holds a.txt). Unpack it"),
    "mixed.npz": (zipped({"a.npy": "1", "b.txt": "1"}), "no array of real numbers"),
    "a.jpk-force": (zipped({"header.properties": "jpk"}), "an atomic force microscope"),
    "pickled.npz": (pickled_npz, "never unpickled"),
    "a.pickle": (a_pickle, "holds NUL bytes"),
    "bomb.npz": (bomb, "bomb.npz"),
    "external.h5": (external, "external link, which is not followed"),
    "cut.mat": (cut_mat, "cannot be read"),
    "cut.h5": (lambda path: path.write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(50)), "damaged"),
    "words.csv": (lambda path: path.write_text("a letter\nto a friend\n"), "no rows of numbers"),
    "empty.csv": (lambda path: path.write_text(""), "the file is empty"),
    "folder": (lambda path: path.mkdir(), "a folder, and no file"),
    "none.csv": (lambda path: None, "no such file"),
    "old.nc": (lambda path: path.write_bytes(b"CDF\x01" + bytes(40)), "netCDF-3"),
    "\x1b[2J.csv": (lambda path: path.write_text("x"), "\\x1b[2J.csv"),
}


@pytest.mark.fault(name="foreign files that are hostile", promise="refused in one line")
@pytest.mark.parametrize("name", FILES)
def test_refused(tmp_path, name):
    write, words = FILES[name]
    write(tmp_path / name)
    with pytest.raises(DataError) as caught:
        import_recording(tmp_path / name, ImportOptions(drive="0", response="1"))
    assert words in str(caught.value) and str(caught.value).isprintable()


def mutated(text: str, rng: random.Random) -> str:
    """A file that was cut, edited, or had a part written twice."""
    for _ in range(rng.randint(1, 5)):
        i = rng.randrange(len(text) + 1)
        choice = rng.randrange(4)
        if choice == 0:
            text = text[:i] + rng.choice(',;\t\n .-e"\u221enan\0#%:') + text[i:]
        elif choice == 1:
            text = text[:i] + text[i + rng.randint(1, 40) :]
        elif choice == 2:
            text = text + text[i : i + 200]
        else:
            text = text[: max(i, 1)]
    return text


@pytest.mark.fault(
    name="foreign text files, damaged",
    promise="read, or refused in one line",
    trials=lambda maker: trials(40),
    seed="the maker's name",
)
@pytest.mark.parametrize("maker", MAKERS)
def test_damaged_text_is_read_or_refused_in_one_line(tmp_path, maker):
    t, u, y = scanned((10.0, 2, 4.5), (20.0, 2, 4.5), sample_hz=400.0)
    write, drive, response = MAKERS[maker]
    rng, whole = random.Random(maker), write(t, u, y)
    options = ImportOptions(drive=drive, response=response, drive_unit="V", response_unit="GHz")
    path = tmp_path / "a.csv"
    for trial in range(trials(40)):
        edited = mutated(whole, rng).encode()
        path.write_bytes(edited if rng.random() < 0.5 else mutated_bytes(whole.encode(), rng))
        try:
            import_recording(path, options)
        except DataError as error:
            said = str(error)
            assert said.isprintable() and 0 < len(said) < 1000, (trial, said)
        except Exception as error:
            raise AssertionError(f"trial {trial}: {type(error).__name__}: {error}") from error
