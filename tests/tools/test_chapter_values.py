"""What is compared between machines: printed text, and the text of tables that cells show."""

import json
import subprocess
import sys

import nbformat
from browser import ROOT

SHOWS = {
    "last": "from navfilters.book import table\ntable([('EKF', 0.125)], 'xy', caption='Errors')",
    "displayed": "display(table([(1, 2)], 'xy', caption='c'))",
    "printed": "print('three')",
}


def test_text_of_tables_and_of_printed_lines(tmp_path):
    cells = [nbformat.v4.new_code_cell(source, id=name) for name, source in SHOWS.items()]
    path, out = tmp_path / "a.ipynb", tmp_path / "a.json"
    nbformat.write(nbformat.v4.new_notebook(cells=cells), path)
    tool = ROOT / "tools" / "chapter_values.py"
    subprocess.run([sys.executable, str(tool), str(path), str(out)], check=True)
    printed = json.loads(out.read_text(encoding="utf-8"))["printed"]
    assert printed["last"].endswith("\nErrors\nx        y\nEKF  0.125\n")
    assert printed["displayed"] == "c\nx  y\n1  2\n"
    assert printed["printed"] == "three\n"
