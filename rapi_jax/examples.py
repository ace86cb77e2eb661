"""A device that behaves like the paper's: Table 1's uncompensated half to 0.7 %."""

import numpy as np

from ._ecdl import ECDL, predict
from ._waveform import triangle
from .operators import RAPI
from .recording._drive import Drive
from .recording._recording import Recording

FREQUENCIES = (10.0, 20.0, 30.0, 40.0)  # Hz
AMPLITUDE = 4.5  # V peak to peak
BIAS = 3.0  # V
NOISE = 0.020  # GHz, of one reading


def paper_device() -> ECDL:
    """The RA-PI device whose eight uncompensated rms nonlinearities are those of Table 1.

    The paper prints neither its parameters nor its drive amplitude; these were found by least
    squares on the table, with 10 plays, a cubic, one shared `lam` and a 4.5 V triangle on a 3 V
    bias.

    >>> from rapi_jax.examples import paper_device
    >>> operator = paper_device().operator
    >>> operator.count, round(float(operator.alpha), 4)  # plays; threshold a half swing
    (10, 0.2811)
    """
    return ECDL(
        RAPI(
            alpha=0.28110,
            zeta=6.7126e-3,
            lam=1.6,
            eta=1.0,
            a=0.63170,
            b=0.1,
            d=(18.787, -1.0789, 0.010040),
            d_0=0.0,
            plays=10,
        )
    )


def paper_drives(*, samples: int = 4000, periods: int = 1) -> tuple[Drive, ...]:
    """The paper's four triangles, `samples` a run over `periods` periods.

    >>> from rapi_jax.examples import paper_drives
    >>> [drive.excitation_hz for drive in paper_drives(samples=100)]  # Hz
    [10.0, 20.0, 30.0, 40.0]
    """
    return triangle(FREQUENCIES, amplitude=AMPLITUDE, bias=BIAS, samples=samples, periods=periods)


def paper_recording(
    *, samples: int = 4000, periods: int = 1, noise: float = NOISE, seed: int = 0
) -> tuple[Recording, list[np.ndarray]]:
    """A recording of the device with white noise (GHz), and the responses without it.

    >>> import numpy as np
    >>> from rapi_jax.examples import paper_recording
    >>> recording, truth = paper_recording(samples=100, noise=0.02)
    >>> len(recording.runs), bool(np.std(recording.runs[0].response - truth[0]) < 0.03)  # GHz
    (4, True)
    """
    device = paper_device()
    drives = paper_drives(samples=samples, periods=periods)
    truth = [np.asarray(predict(device, drive)) for drive in drives]
    rng = np.random.default_rng(seed)
    return Recording.of(drives, [y + noise * rng.standard_normal(y.size) for y in truth]), truth
