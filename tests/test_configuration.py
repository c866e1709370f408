"""Files that only other machines read, workflows, hooks, containers: what can be held of them."""

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))
yaml = pytest.importorskip("yaml")
workflows = pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.stem)


def read(path):
    return yaml.safe_load(path.read_text(encoding="utf-8"))


def steps(workflow):
    return [step for job in workflow["jobs"].values() for step in job["steps"]]


def targets():
    text = (ROOT / "Makefile").read_text(encoding="utf-8")
    return set(re.findall(r"^([a-z]+):", text, re.MULTILINE)) | {".venv/.test", ".venv/.book"}


def made(text):
    """Targets that a command makes."""
    return re.findall(r"\bmake ([\w./]+)", text)


def test_there_are_a_test_a_release_and_a_weekly_one():
    assert {path.stem for path in WORKFLOWS} == {"test", "release", "newest"}
    assert (
        "schedule" in read(ROOT / ".github/workflows/newest.yml")[True]
    )  # YAML reads `on` as true


@workflows
def test_it_may_read_and_no_more_unless_a_job_says_so(path):
    workflow = read(path)
    assert workflow["permissions"] == {"contents": "read"}
    more = {n: job["permissions"] for n, job in workflow["jobs"].items() if "permissions" in job}
    assert more == ({"release": {"contents": "write"}} if path.stem == "release" else {})


@workflows
def test_actions_are_pinned_by_commit_and_keep_no_credentials(path):
    for step in steps(read(path)):
        if "uses" in step:
            assert re.fullmatch(r"actions/[a-z-]+@[0-9a-f]{40}", step["uses"])
        if step.get("uses", "").startswith("actions/checkout@"):
            assert step["with"]["persist-credentials"] is False
    for line in path.read_text(encoding="utf-8").splitlines():
        assert "uses:" not in line or re.search(r"  # v\d+\.\d+\.\d+$", line)


@workflows
def test_its_jobs_end_and_make_what_the_makefile_has(path):
    workflow = read(path)
    assert all(job["timeout-minutes"] <= 150 for job in workflow["jobs"].values())
    for step in steps(workflow):
        assert set(made(step.get("run", ""))) <= targets()


@workflows
def test_one_action_has_one_commit(path):
    every = {s["uses"] for p in WORKFLOWS for s in steps(read(p)) if "uses" in s}
    names = [use.split("@")[0] for use in every]
    assert len(names) == len(set(names))


@workflows
@pytest.mark.skipif(shutil.which("bash") is None, reason="needs bash")
def test_its_scripts_parse(path):
    for step in steps(read(path)):
        script = re.sub(r"\$\{\{.*?\}\}", "x", step.get("run", ""))
        done = subprocess.run(["bash", "-n", "-c", script], capture_output=True, check=False)
        assert done.returncode == 0, done.stderr


@pytest.mark.skipif(shutil.which("bash") is None, reason="needs bash")
def test_without_a_token_nothing_is_uploaded_and_nothing_fails():
    (step,) = read(ROOT / ".github/workflows/release.yml")["jobs"]["index"]["steps"][1:]
    done = subprocess.run(
        ["bash", "-euo", "pipefail", "-c", step["run"]],
        env={"PATH": "/nowhere", "TWINE_PASSWORD": ""},
        capture_output=True,
        text=True,
        check=False,
        executable=shutil.which("bash"),
    )
    assert (done.returncode, done.stdout) == (0, "no PYPI_TOKEN: nothing is uploaded\n")


@pytest.mark.parametrize("tag", ["v0.0.0", None])
def test_a_tag_that_is_not_the_version_stops_the_release(tag):
    step = read(ROOT / ".github/workflows/release.yml")["jobs"]["build"]["steps"][2]
    (code,) = re.findall(r'python -c "(.*?)" "\$GITHUB_REF_NAME"', step["run"])
    from navfilters.version import __version__

    done = subprocess.run(
        [sys.executable, "-c", code, tag or f"v{__version__}"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode == 0) == (tag is None)
    assert done.stderr == ("" if tag is None else f"tag {tag}, version {__version__}\n")


def test_hooks_before_a_commit_are_tools_of_the_lock():
    """In .venv, so that they cannot be of another version than those of ``make lint``."""
    hooks = [h for repo in read(ROOT / ".pre-commit-config.yaml")["repos"] for h in repo["hooks"]]
    assert {repo["repo"] for repo in read(ROOT / ".pre-commit-config.yaml")["repos"]} == {"local"}
    lock = (ROOT / "requirements-test.txt").read_text(encoding="utf-8")
    tools = {Path(hook["entry"].split()[0]) for hook in hooks}
    assert {str(tool.parent) for tool in tools} == {".venv/bin"}
    package = {"lint-imports": "import-linter"}
    for tool in tools:
        assert re.search(rf"^{package.get(tool.name, tool.name)}==", lock, re.MULTILINE)


def test_the_container_makes_what_the_makefile_has():
    settings = json.loads((ROOT / ".devcontainer/devcontainer.json").read_text(encoding="utf-8"))
    assert re.fullmatch(r"mcr\.microsoft\.com/devcontainers/python:3\.1\d-\w+", settings["image"])
    assert made(settings["postCreateCommand"]) == [".venv/.test"]
    assert "chromium" in settings["onCreateCommand"]


def test_binder_gets_the_books_lock_and_then_the_library():
    folder = ROOT / ".binder"
    lines = (folder / "requirements.txt").read_text(encoding="utf-8").splitlines()
    (included,) = [line.removeprefix("-r ") for line in lines if not line.startswith("#")]
    assert (folder / included).resolve() == ROOT / "requirements.txt"
    assert (folder / "runtime.txt").read_text(encoding="utf-8") == "python-3.11\n"
    script = folder / "postBuild"
    assert script.read_text(encoding="utf-8").startswith("#!/bin/bash\n")
    if sys.platform != "win32":
        assert script.stat().st_mode & 0o111
    assert "pip install --no-deps --no-build-isolation -e .\n" in script.read_text(encoding="utf-8")
