"""The types of effect: where one acts, and what else is known of it, is its type.

| type | acts on |
|---|---|
| `AbstractDriveEffect` | the drive, before the operator |
| `AbstractLawEffect` | the numbers of a run that the operator's laws see: rate, amplitude, gain |
| `AbstractOpticalEffect` | the response, after the operator |
| `AbstractCouplingEffect` | the response, with the drive that was sent at hand |

An optical effect that switches where the response crosses thresholds is an `AbstractSwitch`. A
drive or optical effect that is linear and time-invariant is an `AbstractLinearEffect` too: it gives
its transfer function. One that is a sum of first-order lags is an `AbstractLagEffect`: it gives its
modes, and the recursion is shared. One that can be inverted is an `AbstractInvertible`.
"""
