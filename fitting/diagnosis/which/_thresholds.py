"""Numbers that decide which effects are considered, how far each is refitted, and what is named."""

import dataclasses

from rapi_jax.internal import threshold

_TRIAL = "set by trial"


@dataclasses.dataclass(frozen=True)
class WhichThresholds:
    """Numbers that decide which effects are considered and when one counts as explained.

    "Excess" is chi-square above what noise alone would leave.
    """

    # The base.
    guesses: int = threshold(
        4, unit="operators", origin=f"{_TRIAL}; more cost time, fewer may miss the best minimum"
    )
    guesses_beside_given: int = threshold(
        2, unit="operators", origin=f"{_TRIAL}; guesses tried besides the model brought"
    )
    base_steps: int = threshold(40, unit="steps", origin=f"{_TRIAL}; at most, in the base's refit")
    individual_plays_excess: float = threshold(
        0.3,
        unit="of the excess with shared values",
        origin=f"{_TRIAL}; plays with values of their own absorb an effect, and must earn it",
    )
    noise_update: float = threshold(
        0.5,
        unit="of the noise spectrum before",
        origin=f"{_TRIAL}; where noise is unknown a smaller fall ends its re-estimation, and where "
        "it is measured a smaller change of what is faster is left as it was",
    )
    noise_left: float = threshold(
        0.8, unit="of the noise before", origin=f"{_TRIAL}; noise that falls by less is not news"
    )
    more_plays: int = threshold(
        16,
        unit="plays",
        origin="tried besides the 10 where thresholds do not grow with the swing: a play bends all "
        "scans at one drive then. 7 simulated devices of 10 to 40 such plays: the flexible base "
        "leaves 1.03 to 12 of chi-square a line from 10 plays, 1.02 to 1.27 from the best of 10, "
        "16 and 24; without 16 (halved it is as 10, doubled as 24) up to 2.0",
    )
    many_plays: int = threshold(
        24,
        unit="plays",
        origin="the same, up to 1.24 without it; halved it is as 10, and 32 is as good",
    )
    # Screening of initial guesses by score statistics.
    search_margin: float = threshold(
        1.3, unit="of the range of guesses", origin=f"{_TRIAL}; how far beyond a parameter may go"
    )
    search_spread: float = threshold(
        2.0,
        unit="largest over smallest guess",
        origin=f"{_TRIAL}; guesses that spread less do not bound a parameter",
    )
    joint_pairs: int = threshold(
        3,
        unit="pairs",
        origin=f"{_TRIAL}; of those that explain most at once; the rest is not refitted",
    )
    joint_steps: int = threshold(
        30, unit="steps", origin=f"{_TRIAL}; at most, from a pair's first guesses, where none costs"
    )
    parallel_cosine: float = threshold(
        0.98, unit="1", origin=f"{_TRIAL}; cosine of signatures from which two guesses are one"
    )
    rank_tolerance: float = threshold(
        1e-7, unit="of the largest singular value", origin="rounding of the base's Jacobian"
    )
    absorbed_signature: float = threshold(
        1e-12, unit="of a signature's square", origin="rounding; less left is fully absorbed"
    )
    refitted_guesses: int = threshold(
        3, unit="guesses", origin=f"{_TRIAL}; refitted for each effect; more cost time"
    )
    screened_fall: float = threshold(
        0.15,
        unit="of the best score",
        origin="effects below it beyond the flexible base are not refitted. Of 107 simulated "
        "devices with one effect it had 0.7 or more of the best score in 102 and 0.16 in one; "
        "three rate laws score nothing, an amplitude law 0.02 before its guess was refitted. A "
        "half: 0.6 refits more a device, double: one effect is missed",
    )
    screened_chance: float = threshold(
        15.0,
        unit="chi-square",
        origin="the best score in noise of 100 to 300 guesses is 10 to 20; an effect that explains "
        "less cannot be named",
    )
    tied_share: float = threshold(
        0.9,
        unit="of the best score",
        origin="of an effect that jumps: the right step of a quantisation scores as another of 1.4 "
        "times its size does to four digits",
    )
    tied_guesses: int = threshold(
        6, unit="guesses", origin="there were four such steps; more cost time"
    )
    refined_share: float = threshold(
        0.01,
        unit="of the best score",
        origin="guesses below it are not refitted with the base integrated out; an amplitude law "
        "rose from below 4 % of a pickup's to 67 %, a quantisation from 20 % of one to 180 %",
    )
    other_kind_share: float = threshold(
        0.5,
        unit="of the best score",
        origin="set by trial: a creep with rests scored 0.84 of one without, and explained more",
    )
    near_guess_share: float = threshold(
        0.7,
        unit="of the best score",
        origin="of guesses with another signature, refitted too: of two tones the right one "
        "scored 0.94 of the wrong one, and explained a seventh more",
    )
    near_guesses: int = threshold(
        2, unit="guesses", origin="of these at most; each takes a tenth of a second"
    )
    refined_steps: int = threshold(
        4, unit="steps", origin="of an effect's few parameters, from its best guess"
    )
    # Joint refits with one more effect.
    short_steps: int = threshold(4, unit="steps", origin=f"{_TRIAL}; of a short refit")
    long_short_factor: int = threshold(
        3, unit="short refits", origin=f"{_TRIAL}; where the base must first follow the effect"
    )
    full_steps: int = threshold(40, unit="steps", origin=f"{_TRIAL}; at most, of a full refit")
    free_eta_steps: int = threshold(20, unit="steps", origin=f"{_TRIAL}; at most, with free `eta`")
    polynomial_steps: int = threshold(
        4, unit="steps", origin=f"{_TRIAL}; of the polynomial alone, without hysteresis"
    )
    initial_weight: float = threshold(
        0.02, unit="of the weights", origin=f"{_TRIAL}; what is left where a refit starts without"
    )
    # Search and refit in turn, of effects that jump; the search itself: see `jumps`.
    jump_rounds: int = threshold(
        3, unit="rounds", origin=f"{_TRIAL}; of search and refit, for effects that jump"
    )
    jump_round_gain: float = threshold(
        1e-3, unit="of chi-square", origin=f"{_TRIAL}; a smaller fall makes a round the last"
    )
    # Leaders on the flexible base.
    leaders: int = threshold(
        4, unit="effects", origin=f"{_TRIAL}; refitted on the flexible base besides the best"
    )
    flexible_steps: int = threshold(20, unit="steps", origin=f"{_TRIAL}; at most")
    alone_steps: int = threshold(
        80,
        unit="steps",
        origin="at most, of a flexible operator from which those of all effects begin. Of a "
        "simulated device without effects it left 11.1, 5.0, 1.6 and 1.4 of chi-square a line "
        "after 20, 40, 80 and 200; two others end within 25. Only where it turns with the drive: "
        "one against it draws a servo's lag: 6.6 and 0.2 after 20 and 80, a delay beside it 1.7",
    )
    flexible_tolerance: float = threshold(
        2e-3, unit="of the excess", origin=f"{_TRIAL}; two smaller falls in a row end a refit"
    )
    predictor_least_gain: float = threshold(
        5e-3,
        unit="of the lines' number",
        origin="of chi-square, below which a step of an operator that only predicts is slow: its "
        "predictions miss by the noise anyway",
    )
    flexible_round_gain: float = threshold(
        0.03, unit="of chi-square", origin=f"{_TRIAL}; a smaller fall makes a round the last"
    )
    flexible_misfit: float = threshold(
        1.2,
        unit="chi-square a line",
        origin=f"{_TRIAL}; below it neither a second start nor a second search is worth its time",
    )
    second_start_cost: float = threshold(
        3.0, unit="of the first start's final chi-square", origin=f"{_TRIAL}; a start above is left"
    )
    none_start_cost: float = threshold(
        3.0,
        unit="of chi-square without effects",
        origin=f"{_TRIAL}; a start from the best leader's base above it is left",
    )
    none_steps: int = threshold(
        12, unit="steps", origin=f"{_TRIAL}; at most, without effects from the best leader's base"
    )
    none_tolerance: float = threshold(
        2e-3, unit="of the excess", origin=f"{_TRIAL}; two smaller falls in a row end that refit"
    )
    density_rounds: int = threshold(
        3,
        unit="rounds",
        origin="of the effects on a density about the operator, then of the operator: an amplitude "
        "law leaves 2902, 2973, 2895 and 2881 of chi-square after 1, 2, 3 and 4",
    )
    density_tolerance: float = threshold(
        1e-2,
        unit="of the excess",
        origin="two smaller falls in a row end a refit about which a density is taken. Of 24 "
        "leading effects of 7 simulated devices the density left what it does at 1e-4 to 0.1 % in "
        "16, and 9 % more at most, in half to all of the time; at 2e-3 and at 5e-2 the same "
        "effect of each device left least",
    )
    density_round_gain: float = threshold(
        0.05, unit="of chi-square on the base", origin="a smaller fall moves no density"
    )
    # Freedom of the flexible base.
    initial_prior: float = threshold(
        0.3, unit="of a play's band", origin=f"{_TRIAL}; one standard deviation of first outputs"
    )
    # What is left, and what counts as gain.
    pair_enough_sigmas: float = threshold(
        2.0, unit="standard deviations of chi-square", origin="convention; chance besides"
    )
    pair_enough: float = threshold(
        1.05,
        unit="chi-square a line",
        origin="set by trial: creep beside a slew limit left 1.29 where drift beside it, searched "
        "next, leaves 0.92; a right pair 1.04",
    )
    explained_synchronous: float = threshold(
        1.25,
        unit="chi-square a synchronous line",
        origin=f"{_TRIAL}; what a base may leave that is not quite the device's",
    )
    explained_synchronous_sigmas: float = threshold(
        4.0, unit="standard deviations of chi-square", origin=f"{_TRIAL}; chance besides"
    )
    explained_nonsynchronous: float = threshold(
        1.04, unit="chi-square a non-synchronous line", origin=_TRIAL
    )
    explained_nonsynchronous_sigmas: float = threshold(
        5.0, unit="standard deviations of chi-square", origin=f"{_TRIAL}; chance besides"
    )
    chance_fall: float = threshold(
        60.0,
        unit="chi-square",
        origin=f"{_TRIAL}; no search over effects and their guesses finds such a fall in noise",
    )
    chance_fall_divisor: float = threshold(
        4.0, unit="1", origin=f"{_TRIAL}; of `chance_fall`, for more work on an effect"
    )
    full_refit_fall: float = threshold(
        0.2, unit="of the best fall", origin=f"{_TRIAL}; less is not refitted in full"
    )
    leader_fall: float = threshold(
        0.5, unit="of the best fall", origin=f"{_TRIAL}; less is no leader, nor first of a pair"
    )
    leader_excess: float = threshold(
        10.0, unit="of the best's excess or chance", origin=f"{_TRIAL}; more is no rival"
    )
    leader_chance_sigmas: float = threshold(
        4.0, unit="standard deviations of chi-square", origin=f"{_TRIAL}; chance in that excess"
    )
    # Pairs of effects.
    pair_firsts: int = threshold(
        2, unit="effects", origin=f"{_TRIAL}; beside which a second is sought; more cost time"
    )
    pair_swaps: int = threshold(
        2, unit="pairs", origin=f"{_TRIAL}; whose first effect is sought anew; more cost time"
    )
    swap_steps: int = threshold(
        4, unit="steps", origin=f"{_TRIAL}; of the base with the other effect alone"
    )
    pair_gain: float = threshold(
        0.5, unit="of the single effect's excess", origin=f"{_TRIAL}; a second effect removes more"
    )
    pair_chance_sigmas: float = threshold(
        3.5,
        unit="standard deviations of chi-square",
        origin="chance of 1 in 4000: more left by one effect calls for a second. Of 41 simulated "
        "devices that one left so much, but less than `explained_synchronous`, 4 of 5 pairs that "
        "both show were named, and no other answer changed for the worse; half: pairs are searched "
        "on 22 of 86 nulls, not 7, double: two of the four are missed",
    )
    pair_leaves: float = threshold(
        0.4,
        unit="of the excess without effects",
        origin="twice the most that a pair left in which a look-alike was put right (0.2, others "
        "0.06; pairs of two simulated banks); pairs beside something unlisted left 0.06 to 0.97",
    )
    far_above: float = threshold(
        10.0,
        unit="of the pair's excess, or of the number of lines",
        origin="five times what `pair_gain` asks: from there an effect alone is not refitted again",
    )
    foreseen_of_grid: float = threshold(
        10.0,
        unit="times the best score",
        origin="what an effect explains at most whose guesses were not refitted: the grid of a "
        "quantisation that explains nearly all finds 0.07 of it beside a resonance",
    )
    foreseen_of_refit: float = threshold(
        4.0,
        unit="times the best score",
        origin="the same of any: 2.7 times at most in 26 of 27 second effects beside a first, "
        "and 12 times beside a first that had been found in a pair",
    )
    foreseen_of_jumps: float = threshold(
        2.0,
        unit="times the best score",
        origin="the same of one that jumps, whose search takes seconds: 0.9 to 1.6 times in "
        "seven, once 2.3",
    )
    far_from_base: float = threshold(
        10.0,
        unit="of chi-square on the base without effects",
        origin=f"{_TRIAL}; above it a base taken to first order tells nothing of effects: a drive "
        "held at rest left 394 million where no effect left 0.2 on its density",
    )
    exchange_rounds: int = threshold(
        3, unit="best pairs", origin=f"{_TRIAL}; in which others take one's place; more cost time"
    )
    pair_leaders: int = threshold(
        3,
        unit="effects",
        origin="beside a first that may lead beyond the flexible base: beside a mode hop that "
        "stood in for an absorption line ten did, each refitted for 3 to 30 s of CPU",
    )
    pair_base_gain: float = threshold(
        0.3, unit="of the gain on the flexible base", origin=f"{_TRIAL}; least gain on the base"
    )
    pair_excess_unknown_noise: float = threshold(
        0.15,
        unit="of the excess without effects",
        origin="where noise is unknown: more left calls for a second effect. A resonance beside a "
        "slew limit left 0.20 alone, 47 of chi-square a line; double: it is not looked for",
    )
    # The base on which a candidate is judged.
    flexible_base_ratio: float = threshold(
        1.5,
        unit="of the synchronous excess on the flexible base",
        origin=f"{_TRIAL}; where the identified operator leaves more, the flexible base is used",
    )
    likely_probability: float = threshold(
        0.02, unit="probability", origin=f"{_TRIAL}; a less likely effect is not cross-validated"
    )
    likely_candidates: int = threshold(
        2, unit="candidates", origin=f"{_TRIAL}; cross-validated at most; more cost time"
    )


THRESHOLDS = WhichThresholds()
