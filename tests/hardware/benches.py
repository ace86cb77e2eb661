"""A bench file for the simulated laboratory."""

BENCH = """
schema = "rapi.bench/1"
settling = 2

[limits]
low_v = 0.0
high_v = 7.5
slew_v_per_s = 2000.0
step_v = 0.1
max_frequency_hz = 100.0

[generator]
resource = "{generator}"

[laser]
resource = "{laser}"
[laser.limits]
wavelength_nm = [765.0, 781.0]
piezo_percent = [0.0, 100.0]
current_ma = [30.0, 140.0]
diode_c = [15.0, 30.0]
cavity_c = [20.0, 40.0]

[digitizer]
resource = "{digitizer}"
interferometer = {{ connector = 1, low_v = -0.2, high_v = 1.2 }}
cavity = {{ connector = 2, low_v = -0.2, high_v = 1.2 }}
sample_hz = 10e6

[optics]
delay_s = 24.483e-9
fsr_ghz = 1.5
"""


def bench_file(folder, *, generator="GEN", laser="LAS", digitizer="DIG", change=None):
    """Write one; `change`: what to replace by what."""
    text = BENCH.format(generator=generator, laser=laser, digitizer=digitizer)
    for old, new in (change or {}).items():
        assert old in text
        text = text.replace(old, new)
    path = folder / "bench.toml"
    path.write_text(text)
    return path
