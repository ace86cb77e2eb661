"""Numbers that decide which law of the thresholds describes a recording."""

import dataclasses

from rapi_jax.internal import threshold


@dataclasses.dataclass(frozen=True)
class FamilyThresholds:
    """When another law than the paper's is taken for the device's."""

    chance_sigmas: float = threshold(
        4.0,
        unit="standard deviations of chi-square",
        origin="chance, 1 in 30 000: a family that leaves no more than this is not doubted. Half: "
        "2 % of devices without an effect are fitted by all families, which changes no answer; "
        "double: a law off by 0.1 of chi-square a line at 2000 lines is left to the effects",
    )
    log_evidence: float = threshold(
        10.0,
        unit="natural logarithm of the odds",
        origin="odds of 22 000 against a wrong choice by chance. Simulated devices of another law "
        "than RA-PI's have gains above 100 000; halved or doubled it changes none of them",
    )
    share_left: float = threshold(
        0.5,
        unit="of the synchronous excess of the simpler family",
        origin="30 simulated devices with one large effect each. Of a device with RA-PI's "
        "thresholds fixed ones leave 0.7 (a slew limit that cuts every scan) or 1.1 to 350 (all "
        "others); of one with fixed thresholds 0 to 0.27 beside ten effects, 0.54 to 1.2 beside "
        "five whose own excess is larger than that of the wrong law. Half: delays beside "
        "fixed thresholds are fitted by RA-PI; double: the slew limit passes for fixed thresholds",
    )
    amplitudes_of_mixed: int = threshold(
        3,
        unit="amplitudes",
        origin="with two, thresholds that grow slower than the swing are a power of it as well as "
        "a sum: the amplitude law says so. At 2 a negative amplitude law would be absorbed",
    )
    rival_steps: int = threshold(
        40, unit="steps", origin="as the base's; at most, of the amplitude law beside it"
    )
    equal_law: float = threshold(
        1e-3,
        unit="1, exponent of the swing",
        origin="of thresholds that are named fixed, or growing with the swing: rounding, and "
        "mixed ones of which no more than that is fixed. Nothing but the name follows",
    )


THRESHOLDS = FamilyThresholds()
