"""The multiplicative EKF: an attitude that is updated by a product, and measurements underweighted.

The state is a position, a velocity and a unit quaternion; its error has nine components, truth
minus estimate, the last three a rotation vector that is multiplied from the left.
"""

from typing import Any, NamedTuple, Protocol

from navfilters.numerics import validation
from navfilters.numerics.small_matrices import right_divide
from navfilters.space.quaternions import from_rotation_vector, normalized, product
from navfilters.types import Array


class MekfState(NamedTuple):
    """What the multiplicative EKF knows.

    Parameters
    ----------
    r, v : array (..., 3)
        Earth-fixed position, m, and velocity, m/s.
    q_mu : array (..., 4)
        Misalignment of the antenna: the unit quaternion, scalar last and passive, from the nominal
        antenna frame to the actual one.
    P : array (..., 9, 9)
        Covariance of the errors in r, v and misalignment, m, m/s, rad.

    References
    ----------
    pogorelsky2020, Table 1.
    """

    r: Array
    v: Array
    q_mu: Array
    P: Array


_SHAPES = ((3,), (3,), (4,), (9, 9))


class MekfUpdate(NamedTuple):
    """An update, and what it was made from.

    Parameters
    ----------
    state : MekfState
    innovation : array (..., m)
        Measured minus expected; NaN in the members that had no measurement.
    S : array (..., m, m)
        The covariance that the filter gave it, underweighting included; NaN likewise.
    """

    state: MekfState
    innovation: Array
    S: Array


class ImageModel(Protocol):
    """What an update asks of a model: see ``navfilters.space.image_measurement.SarGeometry``."""

    def linearize(self, state: MekfState, measurement: Any) -> tuple[Array, Array, Array]:
        """Residual (..., m), H (..., m, 9) and the measurement's covariance R + B (..., m, m)."""


def mekf_update(
    state: MekfState,
    measurement: Any,
    model: ImageModel,
    *,
    underweighting: Any = 0.0,
    gamma: float | None = None,
) -> MekfUpdate:
    """One update of the multiplicative EKF in Joseph form.

    S = (1 + b) H P H^T + R + B,   K = P H^T S^-1,   dx = K (y - h)
    P+ = (I - K H) P (I - K H)^T + K (b H P H^T + R + B) K^T

    Parameters
    ----------
    state : MekfState
        Before the measurement.
    measurement : Measurement
        What the model takes. Members in which anything of it is NaN keep their state.
    model : ImageModel
        At the time of the measurement.
    underweighting : float or array (...)
        Lear's b, the text's beta-bar, at least 0. By the index rule it is b in the first updates
        and 0 afterwards; an array sets each member's.
    gamma : float, optional
        Trace rule: underweight only members whose root of the trace of the position's covariance
        exceeds this, m. By default all.

    Returns
    -------
    MekfUpdate
        NaN in the members whose S is singular or has a variance that is not positive.

    Raises
    ------
    ValueError
        A state or a linearisation of another shape, masked entries or units; a negative
        underweighting or gamma.

    Notes
    -----
    S holds the squares of 1e-6 (ratios) beside those of 1e3 (m): rows and columns are scaled to a
    unit diagonal before it is solved. Underweighted, this is the EKF for a measurement of
    covariance b H P H^T + R + B, in gain *and* covariance; on a linear model the Kalman filter of
    that covariance, and with b = 0 of R + B. Eq. (39) prints beta for beta-bar. The rotation by
    which the estimate moves is not applied to P: its effect is of second order.

    References
    ----------
    pogorelsky2020, Eqs. (31)-(39).
    """
    state = MekfState(
        *(
            validation.core(f"state.{name}", validation.given(f"state.{name}", part), shape)
            for (name, part), shape in zip(state._asdict().items(), _SHAPES, strict=True)
        )
    )
    if not validation.traced(underweighting):
        underweighting = validation.real_array("underweighting", underweighting, "")
        if not (underweighting >= 0).all():
            raise ValueError(f"underweighting must be at least 0; found {underweighting.min()}")
    if gamma is not None and not validation.traced(gamma):
        gamma = validation.number("gamma", gamma, least=0, needed="a length in m of at least 0")
    y, H, R = model.linearize(state, measurement)
    m = y.shape[-1]
    validation.core("H of model.linearize", H, (m, 9))
    validation.core("R of model.linearize", R, (m, m))
    xp = y.__array_namespace__()
    P, PHt = state.P, state.P @ H.mT
    HPHt = H @ PHt
    b = xp.asarray(underweighting, dtype=P.dtype)
    if gamma is not None:
        position = P[..., 0, 0] + P[..., 1, 1] + P[..., 2, 2]
        b = xp.where(position > gamma * gamma, b, 0.0)
    R_b = b[..., None, None] * HPHt + R  # R' of Eq. (39)
    S = HPHt + R_b
    variance = xp.linalg.diagonal(S)
    scale = 1 / xp.sqrt(xp.where(variance > 0, variance, xp.nan))
    K = right_divide(PHt * scale[..., None, :], scale[..., :, None] * S * scale[..., None, :])
    K = K * scale[..., None, :]
    dx = (K @ y[..., None])[..., 0]
    A = xp.eye(P.shape[-1]) - K @ H
    joseph = A @ P @ A.mT + K @ R_b @ K.mT
    updated = MekfState(
        state.r + dx[..., :3],
        state.v + dx[..., 3:6],
        normalized(product(from_rotation_vector(dx[..., 6:]), state.q_mu)),
        (joseph + joseph.mT) / 2,
    )
    absent = xp.any(xp.isnan(y), axis=-1)
    kept = [
        xp.where(absent[(..., *(None,) * core)], old, new)
        for old, new, core in zip(state, updated, (1, 1, 1, 2), strict=True)
    ]
    return MekfUpdate(MekfState(*kept), y, S)
