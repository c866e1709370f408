"""A ledger in a folder of its own."""

import pytest


@pytest.fixture
def ledger(tmp_path, monkeypatch):
    """Write a ledger in a folder above the working one."""
    (tmp_path / "book" / "part").mkdir(parents=True)
    monkeypatch.chdir(tmp_path / "book" / "part")
    path = tmp_path / "book" / "claims.toml"

    def write(*texts):
        path.write_text("".join(texts), encoding="utf-8")
        return path

    return write
