"""Verdicts: whether a fit is to be trusted, and whether a claim held."""

from ._mutation import Mutation

_VERDICT = "fitting/identification/assessment/_verdict.py"
_REASONS = "fitting/identification/assessment/_reasons.py"
_JUDGED = "tests/fitting/identification/test_verdict.py"
_CLAIMS = "tests/fitting/claim_check"

VERDICTS = (
    Mutation(
        "verdict: one start is enough",
        _REASONS,
        "    if len(starts) == 1:\n",
        "    if False:\n",
        _JUDGED,
    ),
    Mutation(
        "verdict: one start at the best end is enough",
        _REASONS,
        "sum(start.agrees for start in starts) < 2",
        "sum(start.agrees for start in starts) < 1",
        _JUDGED,
    ),
    Mutation(
        "verdict: parameters that nothing fixes",
        _REASONS,
        "    if not undetermined:\n",
        "    if True:\n",
        _JUDGED,
    ),
    Mutation(
        "verdict: a response that does not follow the drive",
        _REASONS,
        "(1.0 - THRESHOLDS.explained_variance) * variance",
        "2.0 * variance",
        _JUDGED,
    ),
    Mutation(
        "verdict: a fit that leaves what it should straighten",
        _REASONS,
        "    if gap > THRESHOLDS.poor_gap * curved and",
        "    if gap > 10.0 * THRESHOLDS.poor_gap * curved and",
        _JUDGED,
    ),
    Mutation(
        "verdict: a response that never changes",
        _REASONS,
        "    if span == 0:\n",
        "    if False:\n",
        _JUDGED,
    ),
    Mutation(
        "verdict: a fit that had not converged",
        _REASONS,
        "    if exact or gain <= gain_tolerance(problem, weight):\n",
        "    if True:\n",
        _JUDGED,
    ),
    Mutation(
        "verdict: the last third is not predicted",
        _REASONS,
        '        if scheme.scheme == "last third" and scheme.large:\n',
        "        if False:\n",
        _JUDGED,
    ),
    Mutation(
        "verdict: a run among others is not predicted",
        _REASONS,
        "        elif scheme.runs and scheme.inside and scheme.large:\n",
        "        elif False:\n",
        _JUDGED,
    ),
    Mutation(
        "verdict: a run beyond the others condemns the fit",
        _REASONS,
        "        elif scheme.runs and scheme.inside and scheme.large:\n",
        "        elif scheme.runs and scheme.large:\n",
        _JUDGED,
    ),
    Mutation(
        "verdict: faults of the data",
        _VERDICT,
        "for fault in faults if not fault.left_out),",
        "for fault in faults if False),",
        _JUDGED,
    ),
    Mutation(
        "claim: held at twice the bound",
        "fitting/claim_check/_check.py",
        "self.rms <= self.bound",
        "self.rms <= 2.0 * self.bound",
        _CLAIMS,
    ),
    Mutation(
        "claim: held where one of several did",
        "fitting/claim_check/_check.py",
        "        return all(judged) if judged else None",
        "        return any(judged) if judged else None",
        _CLAIMS,
    ),
    Mutation(
        "credible set: ends one hypothesis too early",
        "fitting/diagnosis/which/evidence/_conformal.py",
        "        names.append(name)\n        total += probability\n"
        "        if total >= THRESHOLDS.credible_level:\n            break\n",
        "        total += probability\n"
        "        if total >= THRESHOLDS.credible_level and names:\n            break\n"
        "        names.append(name)\n",
        "tests/fitting/diagnosis/which/test_credible_set.py",
    ),
    Mutation(
        "pairs: a drive effect always first",
        "fitting/diagnosis/which/_effect_sets.py",
        "at = places[-1] + 1 if at <= places[-1] else places[0]",
        "at = places[0]",
        "tests/fitting/diagnosis/which/test_effect_sets.py",
    ),
    Mutation(
        "odd values: as probable as usual ones",
        "fitting/diagnosis/which/evidence/_listed_weights.py",
        "np.exp(log_weight + np.array([h.log_prior for h in found]))",
        "np.exp(log_weight)",
        "tests/fitting/diagnosis/which/test_log_prior.py",
    ),
    Mutation(
        "unknown noise: an effect as certain as where it is measured",
        "fitting/diagnosis/which/evidence/_probability.py",
        "    return _keep_unlisted(ranked, THRESHOLDS.unlisted_unknown_noise)\n",
        "    return ranked\n",
        "tests/fitting/diagnosis/which/test_doubt.py",
    ),
    Mutation(
        "next scan: equations taken to be exact",
        "fitting/diagnosis/next_scan/_rival_set.py",
        "        gained = power - wanted * self.tempering.form * stake\n",
        "        gained = power\n",
        "tests/fitting/diagnosis/next_scan/test_rival_set.py",
    ),
    Mutation(
        "next scan: nothing at stake in the scan itself",
        "fitting/diagnosis/next_scan/_rated_scan.py",
        "        stake[pair] = 0.0 if common is None else without[i, common]\n",
        "        stake[pair] = 0.0\n",
        "tests/fitting/diagnosis/next_scan/test_rival_set.py",
    ),
    Mutation(
        "two effects at once: looked for where one alone explains all",
        "fitting/diagnosis/which/_forward_selection.py",
        "    return not explains_most(none, [*singles, *pairs])\n",
        "    return not explains_most(none, pairs)\n",
        "tests/fitting/diagnosis/which/test_forward_selection.py",
    ),
    Mutation(
        "pairs: looked for only where a base could not leave as much",
        "fitting/diagnosis/which/_forward_selection.py",
        "        return exceeds_chance(best.on_flexible_base)\n",
        "        return is_unexplained(best.on_flexible_base)\n",
        "tests/fitting/diagnosis/which/test_forward_selection.py",
    ),
    Mutation(
        "offsets of runs: a drift takes the blame",
        "fitting/diagnosis/which/_shifted_runs.py",
        "    own[list(runs)] = True\n",
        "",
        "tests/fitting/diagnosis/test_broken_data.py",
    ),
    Mutation(
        "start from rest: one missing reading hides it",
        "fitting/identification/data_checks/_first_period.py",
        "not drive.periods or not run.span > 0:",
        "not drive.periods or not run.span > 0 or not run.valid.all():",
        "tests/fitting/identification/data_checks/test_first_period.py",
    ),
)
