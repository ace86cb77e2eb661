"""When a recording was made, and how warm: checked where it is read, kept by both formats."""

from datetime import UTC, datetime

import pytest

from rapi_jax import DataError, Recording
from rapi_jax.examples import paper_recording
from rapi_jax.io import read_recording, write_recording

AT = datetime(2026, 11, 24, 10, tzinfo=UTC)


def recording(**provenance):
    one, _ = paper_recording(samples=40)
    return Recording(one.runs, provenance=provenance)


def with_head(folder, *lines):
    """A recording as a folder, with these lines at the top of its manifest."""
    write_recording(recording(), folder)
    path = folder / "manifest.toml"
    text = path.read_text()
    path.write_text("\n".join([*lines, text]))
    return folder


@pytest.mark.parametrize(
    "line",
    [
        "2026-11-24T10:00:00Z",
        "2026-11-24 11:00:00+01:00",
        '"2026-11-24T10:00:00Z"',
        "2026-11-24T05:00:00.000-05:00",
    ],
)
@pytest.mark.parametrize("suffix", ["", ".nc"])
def test_they_are_read_and_kept(tmp_path, line, suffix):
    path = with_head(tmp_path / "rec", f"recorded_at = {line}", "temperature_c = 21.3")
    one = read_recording(path)
    assert (one.recorded_at, one.temperature_c) == (AT, 21.3)
    write_recording(one, again := tmp_path / f"again{suffix}")
    two = read_recording(again)
    assert (two.recorded_at, two.temperature_c) == (AT, 21.3)
    assert two.sha256() == recording().sha256()


def test_without_them_nothing_is_known():
    one = recording()
    assert one.recorded_at is None and one.temperature_c is None


@pytest.mark.parametrize(
    ("line", "key", "example"),
    [
        ("recorded_at = 2026-11-24T10:00:00", "recorded_at", "2026-11-24T10:00:00Z"),
        ("recorded_at = 2026-11-24", "recorded_at", "its offset from UTC"),
        ('recorded_at = "yesterday"', "recorded_at", "'yesterday'"),
        ("recorded_at = 20261124", "recorded_at", "2026-11-24T10:00:00Z"),
        ('temperature_c = "warm"', "temperature_c", "such as 21.3"),
        ("temperature_c = nan", "temperature_c", "such as 21.3"),
        ("temperature_c = -300", "temperature_c", "'-300'"),
        ("temperature_c = true", "temperature_c", "'True'"),
    ],
)
def test_others_are_refused_with_file_and_key(tmp_path, line, key, example):
    path = with_head(tmp_path / "rec", line)
    with pytest.raises(DataError, match=f"manifest.toml: `{key}` must be") as caught:
        read_recording(path)
    assert example in str(caught.value)
    with pytest.raises(DataError, match=f"`{key}` must be"):
        recording(**{key: line.partition(" = ")[2].strip('"')})
