"""Filters, motion models and systems: trailing axes that do not fit are named, not broadcast."""

from dataclasses import dataclass
from functools import partial

import numpy as np
import pytest
from wrong_models import ALONE, PRIORS, RIGHT, WRONG, Model, Z

from navfilters import FILTERS, Filter, Gaussian, SigmaPoints, run, sweep
from navfilters.estimators.adaptive import AdaptiveNoise
from navfilters.estimators.continuous import extended_kalman_bucy as continuous
from navfilters.estimators.continuous import linearized_kalman_bucy
from navfilters.estimators.continuous_system import ContinuousSystem, Reference
from navfilters.estimators.discrete import DiscreteSystem, predict, update
from navfilters.estimators.discrete import extended_kalman_filter as discrete
from navfilters.estimators.multiplicative import MekfState, mekf_update
from navfilters.estimators.robust import AdaptiveRobust, Robust
from navfilters.space.quaternions import normalized

PRIORS3 = Gaussian(PRIORS.mean, np.stack([PRIORS.cov] * 3))
TWO = SigmaPoints(alpha=[0.5, 1.0])
DIRECT = {
    "h: one of two": ("EKF", "from model.h, must have shape"),
    "h: no axis for the component": ("EKF", "from model.h, must have shape"),
    "h: one too many": ("UKF", "model.h must have shape"),
    "jacobian: a row": ("EKF", "model.jacobian must have shape"),
    "jacobian: a gradient": ("mtSOF", "model.jacobian must have shape"),
    "jacobian: a row too many": ("B-EKF 2", "model.jacobian must have shape"),
    "hessian: one of two": ("mtSOF", "model.hessian must have shape"),
    "hessian: no components": ("mtSOF", "model.hessian must have shape"),
    "R: deviations": ("UKF", r"model.R must have shape \(..., 2, 2\); found \(2,\)"),
    "R: a number": ("EKF", r"model.R must have shape .*; found \(\)"),
    "R: a row": ("UKF", r"model.R must have shape .*; found \(1, 2\)"),
}


@pytest.mark.parametrize("wrong", DIRECT)
def test_a_filter_called_directly_names_the_shape(wrong):
    name, message = DIRECT[wrong]
    with pytest.raises(ValueError, match=message):
        FILTERS[name](PRIORS, Z, Model(**WRONG[wrong]))


@pytest.mark.parametrize("name", FILTERS)
@pytest.mark.parametrize("z", [[50.2], [50.2, 0.92, 1.0], np.ones((3, 1)), 50.2])
def test_a_z_of_another_size_is_refused_directly(name, z):
    with pytest.raises(ValueError, match="must have shape"):
        FILTERS[name](PRIORS, z, RIGHT)


@pytest.mark.parametrize(
    ("go", "message"),
    [
        (
            lambda: FILTERS["EKF"](PRIORS, np.ones((2, 2)), RIGHT),
            r"z \(2,\), prior_and_model \(3,\)",
        ),
        (lambda: FILTERS["B-UKF"](PRIORS, Z, RIGHT, bump=[1.0, 2.0]), r"bump \(2,\), .*\(3,\)"),
        (lambda: FILTERS["UKF"](PRIORS3, Z, RIGHT, points=TWO), r"points \(2,\), prior \(3,\)"),
    ],
)
def test_batch_axes_that_do_not_broadcast_are_named_directly(go, message):
    with pytest.raises(ValueError, match=rf"axes must broadcast; found {message}"):
        go()


@pytest.mark.parametrize("kind", [complex, object, bool, str])
@pytest.mark.parametrize("door", ["prior.mean", "prior.cov", "z", "model.R"])
def test_what_is_no_real_number_is_refused_directly(door, kind):
    given = {"prior.mean": PRIORS.mean, "prior.cov": PRIORS.cov, "z": Z, "model.R": RIGHT.R}
    given[door] = given[door].astype(kind)
    mean, cov, z, R = given.values()
    with pytest.raises(ValueError, match=rf"{door} must be .*real numbers; found dtype"):
        FILTERS["UKF"](Gaussian(mean, cov), z, Model(R=R))


@dataclass(frozen=True)
class Moving:
    Q: object = None
    f: object = staticmethod(lambda x: x)
    F: object = staticmethod(lambda x: np.eye(2))

    def transition(self, x):
        return self.f(x), self.F(x)


class Tripled(Moving):
    def transition(self, x):
        return x, np.eye(2), np.eye(2)


class Gathering(Moving):
    def propagate(self, x, Q):
        return x, np.eye(2), np.array([0.1, 0.2])


GOOD_Q = 0.1 * np.eye(2)
MOTION = {
    "Q: deviations": (Moving(np.array([0.1, 0.2])), "Q must"),
    "Q: a number": (Moving(0.1), "Q must"),
    "Q: of three": (Moving(np.eye(3)), "Q must"),
    "f: one component": (
        Moving(GOOD_Q, lambda x: x[..., :1]),
        "(f.x. of .*transition|dynamics.f) must",
    ),
    "f: a number": (
        Moving(GOOD_Q, lambda x: np.float64(1.0)),
        "(f.x. of .*transition|dynamics.f) must",
    ),
    "F: a row": (Moving(GOOD_Q, F=lambda x: np.ones((1, 2))), "F of .*transition must"),
    "F: a number": (Moving(GOOD_Q, F=lambda x: np.float64(1.0)), "F of .*transition must"),
    "F: a vector": (Moving(GOOD_Q, F=lambda x: np.ones(2)), "F of .*transition must"),
    "propagate": (Gathering(GOOD_Q), "(W of dynamics.propagate|dynamics.Q) must"),
}
REMEMBERING = {
    "no rule": Filter(),
    "second order": FILTERS["mtSOF"],
    "robust": Filter(rule=Robust()),
    "adaptive": Filter(rule=AdaptiveNoise(directions=np.eye(2))),
    "adaptive robust": Filter(rule=AdaptiveRobust()),
}


@pytest.mark.parametrize("filter_", REMEMBERING.values(), ids=REMEMBERING)
@pytest.mark.parametrize("wrong", MOTION)
def test_a_motion_model_is_looked_at(wrong, filter_):
    model, message = MOTION[wrong]
    with pytest.raises(ValueError, match=message):
        filter_.step(filter_.init(PRIORS), Z, RIGHT, model)
    for go in (run, partial(sweep, progress=False)):
        with pytest.raises(ValueError, match=message):
            go(filter_, PRIORS, Z, RIGHT, 2, dynamics=model)


def test_a_motion_model_that_mixes_the_batch_is_refused_by_sweep():
    for model in (
        Moving(GOOD_Q, lambda x: x.reshape(-1, 2)[0]),
        Moving(GOOD_Q, lambda x: x - x.mean(axis=0) if x.ndim > 1 else x),
        Moving(GOOD_Q, F=lambda x: np.linalg.norm(x) * np.ones((*x.shape[:-1], 2, 2))),
        Moving(-GOOD_Q),
        Tripled(GOOD_Q),
    ):
        for go in (run, partial(sweep, progress=False)):
            with pytest.raises(ValueError, match=r"dynamics\..* must"):
                go(Filter(), PRIORS, Z, RIGHT, 2, dynamics=model)


def test_priors_of_filters_with_a_memory_fit():
    """A manifold's error may have fewer components than its states: of init only a model knows."""
    for prior in (
        Gaussian(PRIORS.mean, np.ones(2)),
        Gaussian(PRIORS.mean, np.ones((2, 3))),
        Gaussian(np.float64(1.0), np.eye(1)),
        Gaussian(PRIORS.mean, 1.0),
    ):
        with pytest.raises(ValueError, match=r"prior.* must have shape"):
            Filter(rule=Robust()).init(prior)
    for name in FILTERS:
        with pytest.raises(ValueError, match=r"must have shape"):
            FILTERS[name](Gaussian(PRIORS.mean, np.eye(3)), Z, RIGHT)
        with pytest.raises(ValueError, match=r"prior.cov must have shape \(..., 2, 2\); found"):
            run(FILTERS[name], Gaussian(PRIORS.mean, np.eye(3)), Z, RIGHT, 1)


# --- discrete and continuous systems ------------------------------------------------------------

Q2, R1 = 0.1 * np.eye(2), np.array([[0.1]])


def f(x, u, w, k):
    return x + w


def h(x, v, k):
    return x[..., :1] + v


SYSTEMS = {
    "f: of the first": {"f": lambda x, u, w, k: x.reshape(-1, 2)[0] + w},
    "f: of the mean": {"f": lambda x, u, w, k: x - np.mean(x) + w},
    "f: one component": {"f": lambda x, u, w, k: x[..., :1] + w[:1]},
    "f: in place": {"f": lambda x, u, w, k: np.add(x, w, out=x)},
    "h: no axis": {"h": lambda x, v, k: x[..., 0] + v[0]},
    "h: of the first": {"h": lambda x, v, k: x.reshape(-1, 2)[0, :1] + v},
    "h: of all": {"h": lambda x, v, k: np.sum(x[..., :1], keepdims=True)[0] + 0 * x[..., :1] + v},
    "F: a row": {"F": lambda x, u, w, k: np.ones((1, 2))},
    "L: another w": {"L": lambda x, u, w, k: np.ones((2, 1))},
    "H: a column too many": {"H": lambda x, v, k: np.ones((1, 3))},
    "H: a gradient": {"H": lambda x, v, k: np.ones(2)},
    "M: another v": {"M": lambda x, v, k: np.ones((1, 2))},
    "H: of all": {"H": lambda x, v, k: np.sum(x) * np.ones((*x.shape[:-1], 1, 2))},
}


@pytest.mark.parametrize("wrong", SYSTEMS)
def test_discrete_systems_name_the_function(wrong):
    system = DiscreteSystem(**{"f": f, "h": h, "Q": Q2, "R": R1} | SYSTEMS[wrong])
    with pytest.raises(ValueError, match=rf"system\.{wrong.split(':')[0]} must"):
        discrete(system, PRIORS, np.ones((4, 3, 1)))


@pytest.mark.parametrize("wrong", ["f: one component", "F: a row", "L: another w"])
def test_a_discrete_prediction_alone_names_the_shape(wrong):
    given = {"F": lambda x, u, w, k: np.eye(2), "L": lambda x, u, w, k: np.eye(2)}
    system = DiscreteSystem(**{"f": f, "h": h, "Q": Q2, "R": R1} | given | SYSTEMS[wrong])
    with pytest.raises(ValueError, match=rf"system\.{wrong.split(':')[0]} must have shape"):
        predict(system, PRIORS, np.zeros(0), 0)


@pytest.mark.parametrize("wrong", ["h: no axis", "H: a column too many", "H: a gradient"])
def test_a_discrete_update_alone_names_the_shape(wrong):
    system = DiscreteSystem(
        **{"f": f, "h": h, "Q": Q2, "R": R1, "H": lambda x, v, k: np.eye(2)[:1]}
        | {"M": lambda x, v, k: np.eye(1)}
        | SYSTEMS[wrong]
    )
    with pytest.raises(ValueError, match=rf"system\.{wrong.split(':')[0]} must have shape"):
        update(system, PRIORS, np.ones(1), 1)


def test_a_discrete_system_may_share_its_jacobians_and_deal_out_its_inputs():
    system = DiscreteSystem(lambda x, u, w, k: x + u + w, h, Q2, R1, F=lambda x, u, w, k: np.eye(2))
    u, y = np.random.default_rng(0).normal(size=(2, 4, 3, 2))
    got = discrete(system, PRIORS, y[..., :1], u)
    for i in range(3):
        alone = discrete(system, Gaussian(PRIORS.mean[i], PRIORS.cov), y[:, i, :1], u[:, i])
        np.testing.assert_allclose(got.mean[:, i], alone.mean, rtol=1e-12)


CONTINUOUS = {
    "f: a row": {"f": lambda x, u, w, t: (x + w)[None]},
    "h: a row": {"h": lambda x, v, t: (x[:1] + v)[None]},
    "h: a number": {"h": lambda x, v, t: x[0] + v[0]},
    "A: a vector": {"A": lambda x, u, w, t: np.ones(2)},
    "A: a stack": {"A": lambda x, u, w, t: np.eye(2)[None]},
    "L: another w": {"L": lambda x, u, w, t: np.ones((2, 3))},
    "C: a column too many": {"C": lambda x, v, t: np.ones((1, 3))},
    "M: a vector": {"M": lambda x, v, t: np.ones(1)},
    "f: in place": {"f": lambda x, u, w, t: np.subtract(w, x, out=x)},
}


@pytest.mark.parametrize("wrong", CONTINUOUS)
def test_continuous_systems_name_the_function(wrong):
    right = {"f": lambda x, u, w, t: -x + w, "h": lambda x, v, t: x[:1] + v, "Q": Q2, "R": R1}
    system = ContinuousSystem(**right | CONTINUOUS[wrong])
    for go in (
        partial(continuous, system),
        partial(linearized_kalman_bucy, system, Reference(lambda t: np.zeros(2))),
    ):
        with pytest.raises(ValueError, match=rf"system\.{wrong.split(':')[0]} must"):
            go(ALONE, lambda t: [0.0], [0.0, 1.0])


# --- the multiplicative filter ------------------------------------------------------------------

STATE = MekfState(np.ones(3), np.ones(3), normalized(np.ones(4)), np.eye(9))


class Seen:
    """Four components of nine."""

    def __init__(self, H=np.eye(4, 9), R=np.eye(4)):
        self.H, self.R = H, R

    def linearize(self, state, measurement):
        return np.zeros(4), self.H, self.R


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"state": STATE._replace(P=np.eye(6))}, r"state.P must have shape \(..., 9, 9\)"),
        ({"state": STATE._replace(r=np.ones(1))}, r"state.r must have shape \(..., 3\)"),
        ({"state": STATE._replace(q_mu=np.ones(3))}, r"state.q_mu must have shape \(..., 4\)"),
        (
            {"state": STATE._replace(v=np.ma.masked_less(np.ones(3), 2))},
            "state.v must have no mask",
        ),
        ({"model": Seen(H=np.eye(4, 10))}, r"H of model.linearize must have shape \(..., 4, 9\)"),
        ({"model": Seen(H=np.ones((1, 9)))}, r"H of model.linearize must have shape"),
        ({"model": Seen(R=np.ones(4))}, r"R of model.linearize must have shape \(..., 4, 4\)"),
        ({"model": Seen(R=0.1)}, r"R of model.linearize must have shape \(..., 4, 4\)"),
        ({"underweighting": -0.1}, "underweighting must be at least 0; found -0.1"),
        ({"underweighting": [0.5, np.nan]}, "underweighting must be.*nan"),
        ({"underweighting": True}, "underweighting must be.*bool"),
        ({"gamma": -1.0}, "gamma must be a length in m of at least 0; found -1.0"),
        ({"gamma": True}, "gamma must be a length"),
    ],
)
def test_the_multiplicative_update_names_what_is_wrong(changes, message):
    arguments = {"state": STATE, "measurement": None, "model": Seen()}
    mekf_update(**arguments, underweighting=np.float32(0.5), gamma=np.array(1))
    with pytest.raises(ValueError, match=message):
        mekf_update(**arguments | changes)
