"""Finished chunks are found again, if they are whole and of the same sweep."""

from functools import partial

import numpy as np
import pytest
from moving import WITH_MEMORY, moving
from numpy.testing import assert_array_equal

from navfilters import FILTERS, Gaussian, SigmaPoints, sweep
from navfilters.models import RangeBearing
from navfilters.papers.perea2007.experiment import Setup
from navfilters.runs import records

BASE = Setup()
PRIORS = Gaussian(np.random.default_rng(0).normal(BASE.x0, 10.0, (10, 2)), BASE.prior.cov)
ARGUMENTS = {
    "estimator": FILTERS["EKF"],
    "priors": PRIORS,
    "z": BASE.z,
    "model": BASE.model,
    "steps": 3,
    "chunk": 4,
    "progress": False,
    "record": records.estimate,
}


def stored(folder, **changes):
    return sweep(**ARGUMENTS | changes, checkpoint=folder)


def everything(result):
    return *result.final, *result.record


def assert_same(got, wanted):
    for ours, theirs in zip(everything(got), everything(wanted), strict=True):
        assert_array_equal(ours, theirs)


CALLS = []


def counted(prior, z, model):
    CALLS.append(len(prior.mean))
    return FILTERS["EKF"](prior, z, model)


def test_only_missing_chunks_are_computed(tmp_path):
    wanted = stored(tmp_path / "new", estimator=counted)
    names = [path.name for path in sorted((tmp_path / "new").glob("*.npz"))]
    assert names == ["chunk-000000.npz", "chunk-000001.npz", "chunk-000002.npz"]
    (tmp_path / "new" / names[1]).unlink()
    CALLS.clear()
    assert_same(stored(tmp_path / "new", estimator=counted), wanted)
    assert CALLS == [4, 4, 4]  # three steps of a chunk; the first configuration is known
    assert_same(wanted, sweep(**ARGUMENTS))


def test_a_filter_with_a_memory_comes_back_whole(tmp_path):
    prior, z, sensor, dynamics, steps = moving()
    options = {"dynamics": dynamics, "z_per_step": True, "chunk": 4, "progress": False}
    go = partial(sweep, WITH_MEMORY["AREKF"], prior, z, sensor, steps, **options)
    for _ in ("computed", "loaded"):
        got, wanted = go(checkpoint=tmp_path).state, go().state
        assert type(got) is type(wanted)
        assert type(got.memory) is type(wanted.memory)
        assert_array_equal(got.estimate.cov, wanted.estimate.cov)
        assert_array_equal(got.S, wanted.S)
        for ours, theirs in zip(got.memory, wanted.memory, strict=True):
            assert_array_equal(ours, theirs)


DAMAGE = {
    "a bit": lambda content: content[:300] + bytes([content[300] ^ 1]) + content[301:],
    "the end": lambda content: content[:-40],
    "everything": lambda content: b"",
    "another file": lambda content: b"not an archive, not even a short one",
}


@pytest.mark.parametrize("damage", DAMAGE.values(), ids=DAMAGE)
def test_damage_is_detected(damage, tmp_path):
    wanted = stored(tmp_path)
    file = tmp_path / "chunk-000001.npz"
    file.write_bytes(damage(file.read_bytes()))
    with pytest.raises(ValueError, match=r"chunk-000001.npz is damaged .*; delete it"):
        stored(tmp_path)
    file.unlink()
    assert_same(stored(tmp_path), wanted)


def test_no_changed_byte_changes_the_result(tmp_path):
    """Wherever it is: the damage is detected, or it did not matter."""
    wanted = stored(tmp_path, steps=1)
    file = tmp_path / "chunk-000002.npz"
    content = file.read_bytes()
    harmless = 0
    for i in range(0, len(content), 17):
        file.write_bytes(content[:i] + bytes([content[i] ^ 0x55]) + content[i + 1 :])
        try:
            got = stored(tmp_path, steps=1)
        except ValueError as error:
            assert "chunk-000002.npz" in str(error)  # noqa: PT017
        else:
            assert_same(got, wanted)
            harmless += 1
    assert harmless < len(content) / 17 / 4  # dates and the like


CHANGES = {
    "priors": {"priors": PRIORS._replace(mean=PRIORS.mean + 1e-12)},
    "z": {"z": BASE.z * (1 + 1e-15)},
    "model": {"model": RangeBearing(BASE.model.R * 2)},
    "estimator": {"estimator": FILTERS["UKF"]},
    "option": {"estimator": partial(FILTERS["UKF"], points=SigmaPoints(0.5))},
    "steps": {"steps": 4},
    "chunk": {"chunk": 5},
    "record: nothing": {"record": None},
    "record: another": {"record": records.definite},
    "record: of a truth": {"record": records.Distance(np.array(BASE.x_true))},
    "engine": {"engine": "jax"},
}


@pytest.mark.parametrize("changes", CHANGES.values(), ids=CHANGES)
def test_another_sweep_is_refused(changes, tmp_path):
    if "engine" in changes:
        pytest.importorskip("jax")
    stored(tmp_path)
    with pytest.raises(ValueError, match=r"chunk-000000.npz belongs to another sweep"):
        stored(tmp_path, **changes)


def test_options_are_compared(tmp_path):
    first, second = (partial(FILTERS["B-EKF 1"], bump=bump) for bump in (1.0, 2.0))
    stored(tmp_path, estimator=first)
    with pytest.raises(ValueError, match="belongs to another sweep"):
        stored(tmp_path, estimator=second)
    stored(tmp_path, estimator=partial(FILTERS["B-EKF 1"], bump=1.0))


def test_workers_make_no_other_sweep(tmp_path):
    wanted = stored(tmp_path)
    assert_same(stored(tmp_path, workers=2), wanted)


def test_what_cannot_be_compared_is_refused(tmp_path):
    with pytest.raises(ValueError, match=r"checkpoint needs .* can be pickled.*found <function"):
        stored(tmp_path, estimator=lambda prior, z, model: prior)


def test_half_a_file_does_not_count(tmp_path):
    wanted = stored(tmp_path)
    whole = tmp_path / "chunk-000000.npz"
    whole.rename(whole.with_suffix(".part"))
    assert_same(stored(tmp_path), wanted)


class ClassWide:
    """A sensor as the tutorial writes it: what it has, it has of its class."""

    R = np.array([[4.0]])
    scale = 1.0

    def h(self, x):
        return self.scale * x[..., :1] * GAIN


GAIN = 1.0


@pytest.mark.parametrize(
    ("name", "value"), [("R", np.array([[9.0]])), ("scale", 2.0), ("GAIN", 2.0)]
)
def test_numbers_of_a_class_and_global_ones_belong_to_the_sweep(tmp_path, monkeypatch, name, value):
    """They were not looked at: what was stored with the old ones was taken for the result."""
    changes = {"model": ClassWide(), "z": np.array([5.0])}
    wanted = stored(tmp_path, **changes)
    assert_same(stored(tmp_path, **changes), wanted)
    if name == "GAIN":
        monkeypatch.setitem(globals(), name, value)
    else:
        monkeypatch.setattr(ClassWide, name, value)
    with pytest.raises(ValueError, match="belongs to another sweep"):
        stored(tmp_path, **changes)
