"""A bench file for the simulated laboratory."""

from hardware.simulated import bench_toml


def bench_file(folder, *, generator="GEN", laser="LAS", digitizer="DIG", change=None):
    """Write one; `change`: what to replace by what."""
    at = {"generator": generator, "laser": laser, "digitizer": digitizer}
    text = bench_toml(at, delay_s=24.483e-9)
    for old, new in (change or {}).items():
        assert old in text
        text = text.replace(old, new)
    path = folder / "bench.toml"
    path.write_text(text)
    return path
