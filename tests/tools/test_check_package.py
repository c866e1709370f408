"""The README as a program, and the lower ends of what the package allows."""

import subprocess
import sys
import tomllib

import check_package


def test_the_code_of_a_text_is_its_python_blocks():
    text = "a\n```python\nx = 1\n```\n```\nmake book\n```\n```python\nassert x == 1\n```\n"
    assert check_package.readme_code(text) == "x = 1\n\nassert x == 1\n"


def test_the_readme_has_code_that_fits_together():
    code = check_package.readme_code((check_package.ROOT / "README.md").read_text("utf-8"))
    assert code.count("import") >= 3
    compile(code, "README.md", "exec")


def test_lower_bounds_and_no_upper_ones():
    """The oldest are what ``make dist`` installs; the newest are whatever there is."""
    with (check_package.ROOT / "pyproject.toml").open("rb") as file:
        needed = tomllib.load(file)["project"]["dependencies"]
    assert all(">=" in line and "<" not in line for line in needed)


def test_an_error_ends_all_with_its_output():
    code = f"""
import sys
sys.path.insert(0, {str(check_package.ROOT / "tools")!r})
import check_package
check_package.call(sys.executable, "-c", "raise SystemExit('no such thing')")
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "no such thing" in done.stderr
