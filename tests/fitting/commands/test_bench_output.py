"""A bench file that `rapi bench serve` wrote is written anew; one that was changed since is not."""

import pytest

from fitting.commands.shared.files._measured_output import check_bench_output, sealed
from rapi_jax.io import OutputError

TEXT = "# A simulated laboratory.\n[limits]\nhigh_v = 7.5\n"


def test_a_bench_file_is_written_anew_while_nobody_changed_it(tmp_path):
    path = tmp_path / "bench.toml"
    check_bench_output(path)
    path.write_text(sealed(TEXT))
    check_bench_output(path)
    assert path.read_text().startswith(TEXT)


@pytest.mark.parametrize(
    "change",
    [
        lambda text: text.replace("7.5", "5.0"),  # a limit of one's own
        lambda text: text.replace("[limits]\n", "[limits]\n# the new piezo\n"),
        lambda text: "# The bench in room 2\n" + text,
    ],
)
def test_one_that_was_changed_is_refused(tmp_path, change):
    path = tmp_path / "bench.toml"
    path.write_text(change(sealed(TEXT)))
    with pytest.raises(OutputError, match=r"Choose another name, or move it away"):
        check_bench_output(path)
