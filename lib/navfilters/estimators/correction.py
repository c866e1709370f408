"""How a measurement corrects a prior: at once, or by looking at the model again."""

from collections.abc import Callable
from typing import Any, NamedTuple

from navfilters.estimators.model_parts import difference, retract
from navfilters.estimators.update import (
    Form,
    affine,
    correct,
    covariance_after,
    gain,
    innovation,
    join,
    measured,
)
from navfilters.numerics import validation
from navfilters.numerics.loops import repeat
from navfilters.numerics.matrix_roots import keep_exact, semidefinite_root
from navfilters.numerics.small_matrices import matmul, right_divide
from navfilters.types import Array, Gaussian, Moments


class Observation(NamedTuple):
    """A measurement, the prior that it corrects, and how a filter looks at both.

    Parameters
    ----------
    z : array (..., m)
    model : MeasurementModel
    gone : bool array (..., m) or None
        What was not measured.
    prior : Gaussian
        mean (..., n), cov (..., n, n).
    first : Moments
        Of the prior, before the variant.
    moments, variant : callable
        The filter's stages.
    form : {"joseph", "short", "sqrt"}
    """

    z: Array
    model: Any
    gone: Array | None
    prior: Gaussian
    first: Moments
    moments: Callable[..., Moments]
    variant: Callable[..., tuple[Gaussian, Moments]]
    form: Form

    def expected(self) -> tuple[Gaussian, Moments]:
        """The prior and its moments, after the variant."""
        return self.variant(self.prior, self.model, self.first)

    def again(self, about: Gaussian) -> tuple[Gaussian, Moments, Array]:
        """The prior, its moments and z - z_hat if the model is the affine one about an estimate.

        Parameters
        ----------
        about : Gaussian
            Whose moments give z_hat, H and R.

        Returns
        -------
        Gaussian
            The prior, after the variant.
        Moments
            z_hat stands at the estimate; P_zz and P_xz are those of the prior's covariance.
        array (..., m)
            The residual at the estimate; zero where nothing was measured.
        """
        looked, P = self.moments(about, self.model), self.prior.cov
        H, R = affine(about.cov, looked)
        P_xz = matmul(P, H.mT)
        moments = Moments(looked.z_hat, R + matmul(H, P_xz), P_xz, H, R, self.first.exact)
        changed, moments = self.variant(Gaussian(about.mean, P), self.model, moments)
        y = innovation(self.z, moments, self.model)
        return (Gaussian(self.prior.mean, changed.cov), *self.whole(moments, y))

    def whole(self, moments: Moments, y: Array) -> tuple[Moments, Array]:
        """Moments and residual in which what was not measured says nothing."""
        if self.gone is None:
            return moments, y
        return measured(moments, self.gone), y.__array_namespace__().where(self.gone, 0.0, y)

    def corrected(self, prior: Gaussian, moments: Moments, y: Array) -> Gaussian:
        """The one update that all filters share."""
        return correct(prior, y, moments, self.form, self.model, self.gone)


Correction = Callable[..., Gaussian]


def once(seen: Observation, prior: Gaussian, moments: Moments, y: Array) -> Gaussian:
    """The plain update.

    Parameters
    ----------
    seen : Observation
    prior : Gaussian
        After the variant.
    moments : Moments
        After the variant.
    y : array (..., m)
        The innovation.

    Returns
    -------
    Gaussian
    """
    return seen.corrected(prior, moments, y)


def iterated(
    seen: Observation, prior: Gaussian, moments: Moments, y: Array, *, iterations: int = 10
) -> Gaussian:
    """The prior updated again and again, each time by the model about the last posterior.

    y_i = (z - z_hat_i) - H_i (x - x_i),   with z_hat_i, H_i, R_i from the moments of (x_i, P_i)

    With :func:`~navfilters.estimators.moments.linearized` it is the iterated EKF, whose steps are
    Gauss and Newton's towards the most probable state; with sigma points the iterated posterior
    linearisation filter.

    Parameters
    ----------
    seen, prior, moments, y
        As of :func:`once`.
    iterations : int
        Updates of the prior, at least 1; 1 is the plain one. Full steps, and always so many.

    Returns
    -------
    Gaussian

    Raises
    ------
    ValueError
        Fewer iterations than one.

    Notes
    -----
    The residual is wrapped before the linear term is added. On a manifold the turn of the tangent
    space between two iterates, of second order in their distance, is left out.

    References
    ----------
    bell1993; garcia2015, whose iteration stops by a divergence between iterates.
    """
    validation.whole_number("iterations", iterations, 1)

    def again(_: Array, posterior: Gaussian) -> Gaussian:
        changed, moments, y = seen.again(posterior)
        way = difference(seen.model, seen.prior.mean, posterior.mean)
        y = y - matmul(moments.H, way[..., None])[..., 0]
        return _together(seen.corrected(changed, moments, y))

    start = _together(seen.corrected(prior, moments, y))
    return repeat(again, start, iterations - 1, start.mean.__array_namespace__())


def recursive(
    seen: Observation, prior: Gaussian, moments: Moments, y: Array, *, updates: int = 10
) -> Gaussian:
    """One measurement in many small updates, each by the model about the last: the RUF.

    K_i = (P_i H_i^T + C_i) S_i^-1 / (N + 1 - i),   S_i = H_i P_i H_i^T + H_i C_i + C_i^T H_i^T + R

    C_i, the covariance of error and noise, grows as the same noise is used again.

    Parameters
    ----------
    seen, prior, moments, y
        As of :func:`once`.
    updates : int
        N, at least 1; 1 is the plain update.

    Returns
    -------
    Gaussian
        NaN where R is not semidefinite.

    Raises
    ------
    ValueError
        Fewer updates than one.

    Notes
    -----
    Error and noise are carried as combinations of independent unit noises, e = E w and v = V w, so
    that P = E E^T and C = E V^T need no formula of their own and P is definite in every form.

    References
    ----------
    zanetti2012.
    """
    validation.whole_number("updates", updates, 1)
    moments, y = seen.whole(moments, y)
    H, R = affine(prior.cov, moments)
    xp, exact = R.__array_namespace__(), moments.exact
    root = semidefinite_root(prior.cov)[0]
    E = join([xp.zeros((*y.shape[:-1], H.shape[-1], H.shape[-2])), root], -1)

    def part(
        mean: Array, E: Array, H: Array, R: Array, y: Array, left: Array
    ) -> tuple[Array, Array]:
        N = semidefinite_root(R)[0]
        V = join([N, xp.zeros((*H.shape[:-2], *H.shape[-2:]))], -1) + matmul(H, E)
        K = right_divide(matmul(E, V.mT), matmul(V, V.mT)) / left
        mean = retract(seen.model, mean, matmul(K, y[..., None])[..., 0])
        return mean, E - matmul(K, V)

    def again(k: Array, carry: tuple[Array, Array]) -> tuple[Array, Array]:
        mean, E = carry
        _, moments, y = seen.again(Gaussian(mean, matmul(E, E.mT)))
        return part(mean, E, moments.H, moments.R, y, updates - 1 - k)

    start = part(prior.mean, E, H, R, y, updates)
    mean, E = repeat(again, start, updates - 1, xp)
    cov = matmul(E, E.mT)
    return Gaussian(mean, cov if exact is None else keep_exact(cov, exact))


def recalibrated(seen: Observation, prior: Gaussian, moments: Moments, y: Array) -> Gaussian:
    """The plain update's state, with the covariance that its gain has about that state.

    P+ = P - K P_xz'^T - P_xz' K^T + K P_zz' K^T,   with the moments ' of (x+, P)

    An update that would not make the trace of P smaller is taken back: the prior stays.

    Parameters
    ----------
    seen, prior, moments, y
        As of :func:`once`.

    Returns
    -------
    Gaussian

    Notes
    -----
    The trace changes with the units of the state: in which member an update is taken back may too.

    References
    ----------
    jiang2024, with the gain that it keeps and the trace as the judge.
    """
    after = seen.corrected(prior, moments, y)
    _, P_zz, P_xz, *_ = seen.whole(moments, y)[0]
    K = gain(P_zz, P_xz)
    changed, again, _ = seen.again(Gaussian(after.mean, seen.prior.cov))
    cov = covariance_after(changed.cov, K, again, seen.form)
    if again.exact is not None:
        cov = keep_exact(cov, again.exact)
    xp = cov.__array_namespace__()
    before = xp.broadcast_to(prior.cov, cov.shape)
    worse = (_trace(cov) >= _trace(before))[..., None]
    return Gaussian(
        xp.where(worse, prior.mean, after.mean), xp.where(worse[..., None], before, cov)
    )


def _trace(P: Array) -> Array:
    xp = P.__array_namespace__()
    return xp.sum(xp.linalg.diagonal(P), axis=-1)


def _together(estimate: Gaussian) -> Gaussian:
    """An estimate both of whose arrays have all batch axes, as a compiled loop carries it."""
    mean, cov = estimate
    xp = mean.__array_namespace__()
    batch = xp.broadcast_shapes(mean.shape[:-1], cov.shape[:-2])
    return Gaussian(
        xp.broadcast_to(mean, (*batch, *mean.shape[-1:])),
        xp.broadcast_to(cov, (*batch, *cov.shape[-2:])),
    )
