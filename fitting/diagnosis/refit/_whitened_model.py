"""Whitened errors of models of one recording, and their Jacobian by the operator's values.

The operator is evaluated on one period of each run and read at all samples; effects act on the
whole session. The Jacobian of the operator is exact; that of effects is taken by secants, see
`_effect_jacobian`.
"""

import dataclasses
from collections.abc import Sequence
from functools import cached_property, partial
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Complex, Float, Int

from fitting.diagnosis.noise._lines import SpectralLines
from fitting.diagnosis.noise._periods import PeriodBlock, period_blocks
from fitting.diagnosis.noise._spectrum import Spectrum
from fitting.diagnosis.noise._whitening import Whitener
from rapi_jax import AbstractOperator, Recording
from rapi_jax.effects import AbstractDriveEffect, AbstractLawEffect, AbstractSwitch
from rapi_jax.internal import DriveBatch, needs_spare_nodes, stretches_on_device, to_batch

from ._compiled_stages import (
    OperatorInput,
    acts_before_operator,
    apply_drive_effect,
    apply_optical_effect,
    bent_rows,
    combine_laws,
    gather_samples,
    linearise_response,
    respond,
    set_values,
)
from ._effect_vector import Effects
from ._jump_timing import match_jump_timing
from ._linear_effects import apply_transfer_function, is_linear, transfer_function
from ._recent import Recent
from ._sampling_grids import FirstPeriod, SamplingGrids, nodes_alone
from ._thresholds import THRESHOLDS
from .jacobian._operator_jacobian import Linearised, linearise_in_closed_form
from .jacobian._optical_jacobian import linearise_optical_effects

_GRIDS = 3  # all that there are: of the session, with spare nodes, and of one period
_KEPT = 8  # inputs and responses; a state and its secants ask again for as many


class WhitenedErrors(NamedTuple):
    """Model less data, and the same whitened.

    - `raw`: of each run, in the response's unit. `synchronous`, `nonsynchronous`: whitened.
    - `jump_timing_cost`: chi-square of readings compared with a neighbour's jump.
    """

    raw: list[Float[np.ndarray, "_ _"]]
    synchronous: Float[np.ndarray, " synchronous"]
    nonsynchronous: Float[np.ndarray, " nonsynchronous"]
    jump_timing_cost: float = 0.0

    @property
    def all(self) -> Float[np.ndarray, " lines"]:
        """Whitened errors as one vector, the synchronous ones first."""
        return np.concatenate([self.synchronous, self.nonsynchronous])


@dataclasses.dataclass(frozen=True, eq=False)
class WhitenedModel:
    """One recording, prepared for comparison with many models of it.

    - `blocks`: the whole periods of each run. `own_origin`: whether each run has a zero of its own.
    - `unknown_start`: runs that do not repeat; the initial states of their plays are fitted.
    """

    recording: Recording
    grids: SamplingGrids
    blocks: list[PeriodBlock]
    own_origin: bool
    unknown_start: Bool[np.ndarray, " runs"]

    @classmethod
    def of(cls, recording: Recording) -> "WhitenedModel":
        """The recording, prepared."""
        data = to_batch(recording, lead=True)
        unknown = np.array([not run.drive.repeats for run in recording.runs])
        own = recording.response_origin == "run"
        grids = SamplingGrids(data.drives)
        return cls(recording, grids, period_blocks(recording, data), own, unknown)

    @cached_property
    def span(self) -> float:
        """The widest range of a run's readings."""
        return max(float(np.ptp(block.data)) for block in self.blocks)

    def make_whitener(self, spectrum: Spectrum) -> Whitener:
        """The whitening of this recording's runs for a noise spectrum."""
        return Whitener(self.blocks, spectrum, self.own_origin)

    def initial_state(self, plays: int) -> Float[np.ndarray, "runs plays"] | None:
        """First outputs of the plays as fractions of their bands, NaN where Eq. 13 holds."""
        if not self.unknown_start.any():
            return None
        fraction = THRESHOLDS.play_fraction
        return np.where(self.unknown_start[:, None], fraction, np.nan) + np.zeros((1, plays))

    def initial_state_size(self, plays: int) -> int:
        """Number of unknown initial states, which stand behind the operator's parameters."""
        return int(self.unknown_start.sum()) * plays

    def _padded_initial_state(
        self, operator: AbstractOperator, values: np.ndarray
    ) -> Float[Array, "runs plays"] | None:
        initial = self.initial_state(operator.count)
        if initial is None:
            return None
        size = values.size - self.initial_state_size(operator.count)
        initial[self.unknown_start] = values[size:].reshape(-1, operator.count)
        missing = len(self.grids.session.freq) - len(initial)
        return jnp.asarray(np.pad(initial, [(0, missing), (0, 0)], constant_values=np.nan))

    def set_values(
        self, operator: AbstractOperator, values: Float[np.ndarray, " values"]
    ) -> AbstractOperator:
        """The operator with the first elements of `values` as its parameters."""
        return set_values(operator, jnp.asarray(values))

    def _drives(self, effects: Effects) -> DriveBatch:
        """The drives with the grid that these effects need."""
        if needs_spare_nodes(effects):
            return self.grids.session_with_spare_nodes
        changed = any(isinstance(effect, AbstractDriveEffect) for effect in effects)
        return self.grids.session if changed else self.grids.period

    @cached_property
    def _unchanged_input(self) -> OperatorInput:
        """What reaches the operator where no effect stands before it."""
        drives = self.grids.period
        return OperatorInput(
            combine_laws((), self.grids.samples), drives.node_u, drives.u_min, drives.stretches
        )

    def operator_input(self, effects: Effects) -> OperatorInput:
        """What reaches the operator behind the effects that act before it."""
        if not any(acts_before_operator(effect) for effect in effects):
            return self._unchanged_input
        before = tuple(effect for effect in effects if acts_before_operator(effect))
        return self._inputs.get(before, lambda: self._changed_input(before))

    @cached_property
    def _inputs(self) -> Recent[OperatorInput]:
        return Recent(_KEPT)

    def _changed_input(self, effects: Effects) -> OperatorInput:
        sent, reached = self._drives(effects), self._reached(effects)
        u, u_min, stretches = sent.node_u, sent.u_min, sent.stretches
        if reached is not sent:
            u, u_min = reached.node_u, reached.u_min
            stretches = stretches_on_device(np.asarray(u))
        law_effects = tuple(e for e in effects if isinstance(e, AbstractLawEffect))
        return OperatorInput(combine_laws(law_effects, self.grids.samples), u, u_min, stretches)

    def _reached(self, effects: Effects) -> DriveBatch:
        """The drives behind the effects that act on them, on the nodes alone, with their minima."""
        sent = self._drives(effects)
        on_drive = tuple(e for e in effects if isinstance(e, AbstractDriveEffect))
        if not on_drive:
            return sent

        def through() -> DriveBatch:
            nodes, u_min = self._nodes.get((sent,), lambda: nodes_alone(sent)), sent.u_min
            for effect in on_drive:
                nodes, u_min = apply_drive_effect(effect, nodes)
            return dataclasses.replace(nodes, u_min=u_min)

        return self._behind.get(on_drive, through)

    def reached_rows(self, effects: Effects) -> Float[np.ndarray, "runs time"] | None:
        """The drive that reaches the operator, at the samples; `None` if nothing changes it."""
        if not any(isinstance(effect, AbstractDriveEffect) for effect in effects):
            return None
        reached, place = self._reached(effects), self._drives(effects).place
        return np.asarray(jnp.take_along_axis(reached.node_u, place, axis=1))

    def _optical_rows(self, effects: Effects) -> tuple[DriveBatch, Int[Array, "runs rows"]]:
        """The rows that effects behind the operator see, and which node each of their places is.

        Where a drive bends between samples, every other place is such a bend.
        """
        drives = self._drives(effects)
        if not drives.spare:
            return self.grids.samples, drives.place
        reached = self._reached(effects)
        return self._bent_rows.get((reached,), lambda: bent_rows(drives, reached))

    def operator_response(
        self, operator: AbstractOperator, values: Float[np.ndarray, " values"], effects: Effects
    ) -> Float[Array, "runs grid"]:
        """The operator's response on the sampling grid of all runs, behind drive effects.

        `values`: the operator's parameters, then the unknown initial states.
        """
        given = self.operator_input(effects)  # the same object for the same effects on the drive
        key = (operator, values.tobytes(), given)
        return self._answers.get(key, lambda: self._respond(operator, values, given))

    def _respond(
        self, operator: AbstractOperator, values: np.ndarray, given: OperatorInput
    ) -> Float[Array, "runs grid"]:
        start = self._padded_initial_state(operator, values)
        response = respond(operator, values, given, start)
        if _is_known(response):
            return response
        return respond(operator, values, given._replace(stretches=None), start)

    @cached_property
    def _answers(self) -> Recent[Float[Array, "runs grid"]]:
        return Recent(_KEPT)

    def linearise_operator(
        self, operator: AbstractOperator, values: Float[np.ndarray, " values"], effects: Effects
    ) -> Linearised:
        """The same at the samples of the first period, with its derivative by each value."""
        start, given = self._padded_initial_state(operator, values), self.operator_input(effects)
        place = self.first_period_places(effects)
        found = linearise_in_closed_form(operator, values, given, start, place)
        if found is not None:
            return found
        given = given._replace(stretches=None)
        response, derivative = linearise_response(operator, values, given, start)
        return Linearised(
            self.at_first_period(effects, response), self.at_first_period(effects, derivative)
        )

    def response_rows(
        self, effects: Effects, operator_response: Float[Array, "runs grid"]
    ) -> Float[np.ndarray, "runs time"]:
        """The model's response on the padded rows of samples."""
        return self._rows(effects, operator_response)[0]

    def _rows(
        self, effects: Effects, operator_response: Float[Array, "runs grid"]
    ) -> tuple[np.ndarray, list[np.ndarray]]:
        """The same, and what each switch adds."""
        (rows, place), every = self._optical_rows(effects), 2 if self._drives(effects).spare else 1
        key: tuple[object, ...] = (rows, operator_response)
        nu = self._responses.get(key, lambda: gather_samples(operator_response, place))
        jumps = []
        for effect in effects:
            if acts_before_operator(effect):
                continue
            key, before = (*key, effect), nu
            nu = self._responses.get(key, partial(apply_optical_effect, effect, rows, before))
            if isinstance(effect, AbstractSwitch):
                jumps.append((np.asarray(nu) - np.asarray(before))[:, ::every])
        return np.asarray(nu)[:, ::every], jumps

    @cached_property
    def _responses(self) -> Recent[Array]:
        return Recent(_KEPT)

    def block_errors(
        self,
        whitener: Whitener,
        effects: Effects,
        operator_response: Float[Array, "runs grid"],
        blocks: Sequence[tuple[int, PeriodBlock]] | None = None,
    ) -> tuple[list[Float[np.ndarray, "_ _"]], float]:
        """Model less data on each block, and the price of readings matched to a neighbour's jump.

        `blocks`: others than the model's own, each with the number of its run. Masked readings have
        no error.
        """
        rows, jumps = self._rows(effects, operator_response)
        out, price = [], 0.0
        for k, block in enumerate(self.blocks) if blocks is None else blocks:
            error = block.interpolate(rows[k]) - block.data
            if block.has_masked:
                error *= block.use
            if jumps:
                variance = (
                    whitener.reading_variance[k]
                    if blocks is None
                    else whitener.spectrum.mean_variance(SpectralLines.of(block))
                )
                error, paid = match_jump_timing(error, [j[k] for j in jumps], block, variance)
                price += paid
            out.append(error)
        return out, price

    def evaluate_errors(
        self, whitener: Whitener, effects: Effects, operator_response: Float[Array, "runs grid"]
    ) -> WhitenedErrors:
        """Model less data, raw and whitened; masked readings have no error."""
        raw, price = self.block_errors(whitener, effects, operator_response)
        return WhitenedErrors(raw, *whitener.whiten(raw), price)

    @cached_property
    def _transfers(self) -> Recent[list[Complex[np.ndarray, " lines"]]]:
        return Recent(_KEPT)

    @cached_property
    def _first_period(self) -> FirstPeriod:
        return FirstPeriod.of(self.blocks, len(self.grids.session.freq))

    @cached_property
    def _nodes(self) -> Recent[DriveBatch]:
        return Recent(_GRIDS)

    @cached_property
    def _behind(self) -> Recent[DriveBatch]:
        return Recent(_KEPT)

    @cached_property
    def _bent_rows(self) -> Recent[tuple[DriveBatch, Array]]:
        return Recent(_KEPT)

    @cached_property
    def _first_period_samples(self) -> DriveBatch:
        return self._first_period.samples(self.grids.samples)

    @cached_property
    def _first_periods(self) -> Recent[DriveBatch]:
        return Recent(_GRIDS)

    def _first_period_drives(self, effects: Effects) -> DriveBatch:
        drives = self._drives(effects)
        return self._first_periods.get((drives,), lambda: self._first_period.select(drives))

    def first_period_places(self, effects: Effects) -> Int[np.ndarray, "runs time"]:
        """Which of the sampling grid each sample of a run's first period is."""
        return np.asarray(self._first_period_drives(effects).place)

    def at_first_period(
        self, effects: Effects, response: Float[Array | np.ndarray, "*more runs grid"]
    ) -> Float[np.ndarray, "*more runs time"]:
        """Responses on the sampling grid, read at the samples of each run's first period."""
        values, place = np.asarray(response), self.first_period_places(effects)
        return np.take_along_axis(values, place[(None,) * (values.ndim - 2)], axis=-1)

    def jacobian_operator(
        self, whitener: Whitener, effects: Effects, operator: Linearised
    ) -> Float[np.ndarray, "synchronous values"]:
        """Derivative of the synchronous errors by each value, from that of the operator's response.

        Linear effects multiply by their transfer functions, as if they came last.
        """
        behind = [e for e in effects if not acts_before_operator(e)]
        samples = self._first_period_samples
        rows = linearise_optical_effects([e for e in behind if not is_linear(e)], samples, operator)
        linear = tuple(effect for effect in behind if is_linear(effect))
        transfer: list[Complex[np.ndarray, " lines"]] = []
        if linear:
            transfer = self._transfers.get(
                linear, lambda: [transfer_function(linear, block) for block in self.blocks]
            )
        parts = []
        for k, (block, begin) in enumerate(zip(self.blocks, self._first_period.first, strict=True)):
            row, share = rows[:, k, :], block.fraction[0]
            left, right = block.left[0] - begin, block.right[0] - begin
            value = (1.0 - share) * row[:, left] + share * row[:, right]
            if linear:
                value = apply_transfer_function(transfer[k], value, block)
            parts.append((value * block.use.mean(axis=0))[:, None, :])
        return whitener.whiten_mean_period(parts).T


def _is_known(response: Float[Array, "runs grid"]) -> bool:
    """Whether monotone stretches tell the response: not where a falling bound falls."""
    return not np.isnan(np.asarray(response)[:, 0]).any()
