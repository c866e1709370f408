"""The random order of tests."""

import shuffled


def test_a_seed_gives_one_order_of_all_tests(monkeypatch):
    orders = {}
    for seed in ("1", "2", "1"):
        monkeypatch.setattr(shuffled, "SEED", seed)
        items = list(range(100))
        shuffled.pytest_collection_modifyitems(items)
        assert orders.setdefault(seed, items) == items
        assert sorted(items) == list(range(100)) != items
    assert orders["1"] != orders["2"]


def test_the_seed_is_told():
    assert f"NAVFILTERS_ORDER={shuffled.SEED} " in shuffled.pytest_report_header()
