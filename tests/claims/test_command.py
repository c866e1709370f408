"""The ledger in a terminal."""

import subprocess
import sys
from pathlib import Path

import pytest

from navfilters.__main__ import COMMANDS, main
from navfilters.book import claims
from navfilters.book.claims.command import main as ledger


def test_it_counts_the_verdicts_of_each_work(capsys):
    assert ledger([]) == 0
    rows = capsys.readouterr().out.splitlines()
    said = sum(int(part.split()[0]) for row in rows[:-1] for part in row.split(": ")[1].split(", "))
    assert said == len(claims.load())
    assert {row.split(":")[0] for row in rows} >= {
        "Perea et al. 2007",
        "Xiong et al. 2009",
        "this book",
    }


def test_words_and_a_verdict_choose(capsys):
    assert ledger(["UKF", "--verdict", "not reproduced"]) == 0
    heads = [row for row in capsys.readouterr().out.splitlines() if not row.startswith(" ")]
    assert heads
    assert all(row.endswith(": not reproduced") for row in heads)


@pytest.mark.parametrize("words", [["xiong2009", "AREKF"], ["Xiong", "2009", "arekf"]])
def test_a_work_is_found_by_its_key_and_by_its_name(words, capsys):
    assert ledger(words) == 0
    assert "xiong-" in capsys.readouterr().out


def test_one_claim_is_shown_whole(capsys):
    assert ledger(["own-map-bits"]) == 0
    text = " ".join(capsys.readouterr().out.split())
    claim = claims.load()["own-map-bits"]
    for part in (claim.statement, "source: this book", claim.chapter, claim.route):
        assert " ".join(part.split()) in text


def test_nothing_found_is_a_status(capsys):
    assert ledger(["no such words"]) == 1
    assert capsys.readouterr().err == "no claim has all of that\n"


def test_a_ledger_that_is_not_there_is_named(tmp_path, capsys):
    with pytest.raises(SystemExit, match="2"):
        ledger(["--ledger", str(tmp_path / "none.toml")])
    assert "none.toml" in capsys.readouterr().err


def test_every_command_is_listed_and_says_what_it_takes(capsys):
    """Of each, the help; those that need an extra say it only when they run."""
    with pytest.raises(SystemExit, match="0"):
        main(["--help"])
    text = capsys.readouterr().out
    assert {"crash-test", "diagnose", "claims", "perea2007", "cures", "w3b"} <= set(COMMANDS)
    for name in COMMANDS:
        assert f"\n  {name} " in text
        with pytest.raises(SystemExit, match="0"):
            main([name, "--help"])
        assert capsys.readouterr().out.startswith(f"usage: navfilters {name} ")


def test_no_command_is_status_2(capsys):
    with pytest.raises(SystemExit, match="2"):
        main(["fly"])
    assert "fly" in capsys.readouterr().err


def test_an_installed_package_has_a_ledger_of_its_own(tmp_path, monkeypatch):
    """Beside the module, as a wheel puts it; a book above the working folder comes first."""
    from navfilters.book.claims import ledger as module

    monkeypatch.setattr(module, "__file__", str(tmp_path / "ledger.py"))
    away = tmp_path / "away"
    away.mkdir()
    with pytest.raises(claims.ClaimError, match=r"no book/claims\.toml"):
        claims.find(away)
    (tmp_path / "claims.toml").write_text("")
    assert claims.find(away) == tmp_path / "claims.toml"
    here = Path(__file__).resolve().parents[2]
    assert claims.find(here) == here / "book/claims.toml"


@pytest.mark.slow
def test_as_a_module():
    done = subprocess.run(
        [sys.executable, "-m", "navfilters", "--version"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0
