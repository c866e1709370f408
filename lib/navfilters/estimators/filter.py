"""A filter is one pipeline, and each work changes one stage of it.

::

    predict --rule on P--> moments --variant--> correction --retraction--> state
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from navfilters.estimators import model_parts
from navfilters.estimators.correction import Correction, Observation, once
from navfilters.estimators.limits import textbook
from navfilters.estimators.moments import linearized
from navfilters.estimators.options import accepted, keywords
from navfilters.estimators.prediction import PREDICTIONS, in_parts, predict_linearized
from navfilters.estimators.rule import Rule
from navfilters.estimators.state import (
    FilterState,
    first_state,
    given_prior,
    keep,
    keep_estimate,
    kept,
    missed,
)
from navfilters.estimators.update import FORMS, Form, absent, fit, innovation
from navfilters.estimators.variants import Variant, unchanged
from navfilters.numerics import validation
from navfilters.types import Array, Gaussian, MeasurementModel, Moments

STAGES = ("moments", "variant", "correction")
"""Those that have options."""


@dataclass(frozen=True)
class Filter:
    """A filter as its stages.

    ``filter(prior, z, model)`` is one update of one prior. ``init``, ``predict``, ``update`` and
    ``step`` are the same with a state, for ``run`` and ``sweep``.

    Parameters
    ----------
    moments : callable
        (prior, model, \\*, options) -> Moments.
    variant : callable
        (prior, model, moments, \\*, options) -> (prior, Moments).
    rule : Rule, optional
        Robust and adaptive filters have one.
    form : {"joseph", "short", "sqrt"}
        Of the update: see :func:`~navfilters.estimators.update.kalman_update`.
    correction : callable
        (observation, prior, moments, innovation, \\*, options) -> Gaussian: see
        :mod:`navfilters.estimators.correction`.

    Raises
    ------
    ValueError
        An unknown form.
    """

    moments: Callable[..., Moments] = linearized
    variant: Variant = unchanged
    rule: Rule | None = None
    form: Form = "joseph"
    correction: Correction = once

    def __post_init__(self) -> None:
        if self.form not in FORMS:
            raise ValueError(f"form must be one of {list(FORMS)}; found {self.form!r}")

    def __call__(
        self, prior: Gaussian, z: Array, model: MeasurementModel, **options: Any
    ) -> Gaussian:
        """One update of every member, without rule and memory.

        Parameters
        ----------
        prior : Gaussian
            mean (..., n), cov (..., n, n).
        z : array (..., m)
            The measurement; NaN where it was not measured.
        model : MeasurementModel
            Where it comes from.
        **options
            Those of the stages; see ``options``.

        Returns
        -------
        Gaussian
            The updated state. Of arrays only their kind and their trailing axes are checked here;
            ``run`` checks their values and the model.

        Raises
        ------
        ValueError
            Masked entries, units, no numbers, trailing axes that do not fit together.
        TypeError
            An option that this filter does not have; a filter with a rule, which has a memory.
        """
        if self.rule is not None:
            raise TypeError(
                "a filter with a rule has a memory: use run, sweep, or init and step; found "
                f"{type(self.rule).__name__}"
            )
        prior = given_prior(prior)
        z, model = model_parts.seen(validation.given("z", z), model, 0)
        told, gone = self.having(**options) if options else self, absent(z)
        updated, *_ = told._corrected(prior, z, model, gone, told.variant)
        return kept(gone, prior, updated)

    @property
    def options(self) -> tuple[str, ...]:
        """Names of the keywords that this filter takes."""
        return tuple(name for stage in STAGES for name in keywords(getattr(self, stage)))

    def having(self, **options: Any) -> "Filter":
        """The same filter with these options.

        Parameters
        ----------
        **options
            As in a call.

        Returns
        -------
        Filter

        Raises
        ------
        TypeError
            An option that this filter does not have.
        """
        self._know(options)
        stages: dict[str, Any] = {}
        for name in STAGES:
            stage = getattr(self, name)
            if own := accepted(stage, options):
                stages[name] = partial(stage, **own)
        return replace(self, **stages)

    def _know(self, options: dict[str, Any]) -> None:
        unknown = options and set(options) - set(self.options)
        if unknown:
            has = ", ".join(self.options) or "none"
            raise TypeError(f"unknown options {sorted(unknown)}; this filter has {has}")

    def init(self, prior: Gaussian) -> FilterState:
        """The state before any step.

        Parameters
        ----------
        prior : Gaussian
            mean (..., n), cov (..., n, n).

        Returns
        -------
        FilterState
        """
        return first_state(prior, self.rule)

    def predict(self, state: FilterState, dynamics: Any, k: Array = 0) -> FilterState:
        """The state one transition later.

        Parameters
        ----------
        state : FilterState
        dynamics : Dynamics
        k : int
            Number of the step, from 0.

        Returns
        -------
        FilterState
            Its innovation is still that of the last update.
        """
        dynamics = model_parts.at(dynamics, k)
        Q, memory = validation.given("dynamics.Q", dynamics.Q), state.memory
        if self.rule is not None:
            Q, memory = self.rule.process_noise(memory, Q)
        function = getattr(self.moments, "func", self.moments)
        predict = PREDICTIONS.get(function, predict_linearized)
        options = accepted(predict, getattr(self.moments, "keywords", {}))
        if self.rule is not None and self.rule.parts:
            estimate, W = in_parts(predict, state.estimate, dynamics, Q, **options)
            memory = self.rule.noise_added(memory, W)
        else:
            estimate = predict(state.estimate, dynamics, Q, **options)
        return state._replace(estimate=estimate, memory=memory)

    def update(self, state: FilterState, z: Array, sensor: Any, k: Array = 0) -> FilterState:
        """The state after a measurement.

        Parameters
        ----------
        state : FilterState
        z : array (..., m)
            NaN where it was not measured.
        sensor : MeasurementModel
        k : int
            Number of the step, from 0.

        Returns
        -------
        FilterState
        """
        z, sensor = model_parts.seen(validation.given("z", z), sensor, k)
        gone = absent(z)
        prior, memory, moments = state.estimate, state.memory, None
        if self.rule is not None:
            prior, memory, moments = self._ruled(state, z, sensor, gone)
        variant = model_parts.at(self.variant, k)
        estimate, y, S = self._corrected(prior, z, sensor, gone, variant, moments)
        estimate = kept(gone, state.estimate, estimate)
        return FilterState(estimate, missed(state, gone), memory, y, S)

    def _corrected(
        self,
        prior: Gaussian,
        z: Array,
        model: Any,
        gone: Array | None,
        variant: Variant,
        moments: Moments | None = None,
    ) -> tuple[Gaussian, Array, Array]:
        """The corrected prior, the innovation and its covariance."""
        if moments is None:
            moments = self.moments(prior, model)
        seen = Observation(z, model, gone, prior, moments, self.moments, variant, self.form)
        changed, moments = seen.expected()
        fit(changed, z, moments)
        y = innovation(z, moments, model)
        return self.correction(seen, changed, moments, y), y, moments.P_zz

    def _ruled(
        self, state: FilterState, z: Array, sensor: Any, gone: Array | None
    ) -> tuple[Gaussian, Any, Moments | None]:
        """Prior and memory by the rule, which does not act where not all was measured."""
        assert self.rule is not None
        before, y, moments = state.estimate, None, None
        if self.rule.looks:
            moments = self.moments(before, sensor)
            y = innovation(z, moments, sensor)
        prior, memory = self.rule.enlarge(state.memory, before, y, moments)
        if gone is not None:
            xp = gone.__array_namespace__()
            some = xp.any(gone, axis=-1)
            prior = keep_estimate(some, before, prior)
            batch = xp.broadcast_shapes(some.shape, prior.mean.shape[:-1], prior.cov.shape[:-2])
            memory = keep(xp.broadcast_to(some, batch), state.memory, memory)
        return prior, memory, moments if prior is before else None

    def step(
        self,
        state: FilterState,
        z: Array,
        sensor: Any,
        dynamics: Any = None,
        k: Array = 0,
    ) -> FilterState:
        """A prediction, where there are dynamics, and an update.

        Parameters
        ----------
        state : FilterState
        z : array (..., m)
        sensor : MeasurementModel
        dynamics : Dynamics, optional
        k : int
            Number of the step, from 0.

        Returns
        -------
        FilterState
        """
        if dynamics is not None:
            state = self.predict(state, dynamics, k)
        return self.update(state, z, sensor, k)

    def linear_limit(
        self, prior: Gaussian, z: Array, model: MeasurementModel, **options: Any
    ) -> Gaussian:
        """What this filter's first update must be on a linear model, by the textbook's filter.

        Parameters
        ----------
        prior, z, model
            As in a call, with h(x) = H x.
        **options
            As in a call; those of the sigma points change nothing here.

        Returns
        -------
        Gaussian
            Computed in the information form, (P^-1 + H^T R^-1 H)^-1, by LAPACK: no line of the
            filters takes part.
        """
        z, prior = validation.given("z", z), given_prior(prior)
        H, R = model.jacobian(prior.mean), model_parts.noise(model, prior.mean)
        P = prior.cov if self.rule is None else self.rule.limit(prior.cov)
        variant = model_parts.at(self.variant, 0)
        return textbook(variant, accepted(variant, options), Gaussian(prior.mean, P), z, H, R)
