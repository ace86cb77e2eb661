"""Effects on the drive, on the laws, and the delay, at sizes that a real device shows."""

from rapi_jax.effects._amplifier_lowpass import AmplifierLowpass
from rapi_jax.effects._amplitude_law import AmplitudeLaw
from rapi_jax.effects._delay import Delay
from rapi_jax.effects._quantisation import Quantisation
from rapi_jax.effects._rate_law import RateLaw
from rapi_jax.effects._saturation import Saturation
from rapi_jax.effects._slew_limit import SlewLimit

# For a drive of 3 V peak to peak about 3 V at 10 to 40 Hz.
EXAMPLES = {
    "amplifier_lowpass": AmplifierLowpass(tau=1.1e-4),  # 1.4 kHz
    "slew_limit": SlewLimit(limit=200.0),  # a triangle at 40 Hz needs 240 V/s
    "delay": Delay(tau=1.3e-4),
    "saturation": Saturation(low=1.55, high=4.4, knee=1e-3),  # 1.7 and 3.3 % of the swing
    "quantisation": Quantisation(step=3.0 / 2**10, origin=1.5),
    "rate_law": RateLaw(exponent=1.6),
    "amplitude_law": AmplitudeLaw(threshold=0.2, gain=0.02, tilt=0.01, reference=4.0, centre=2.5),
}
