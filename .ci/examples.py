#!/usr/bin/env python3
"""Runs the examples of the documentation, so that what it tells people to type works.

In the Markdown files given, a fenced block is an example by what follows its opening fence:

    ```toml file=NAME   (or csv) becomes the file NAME in the folder where all of a page's examples run
    ```sh run           is run line by line with `zonobench` and `lake` there; it must succeed
    ```sql              is a query of the lake, which must give at least one row
    ```python run       is run by the Python given

Prints a line an example; exit code 1 where one fails.
"""

import argparse
import csv
import io
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

FENCE = re.compile(r"^```(\w+)([^\n]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def call(command, folder, path):
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, env={**os.environ, "PATH": path})
    if done.returncode != 0:
        raise AssertionError(f"exit code {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


def run_block(language, info, text, folder, options):
    """What kind of example it was; None if it is none."""
    path = f"{folder}/bin:{os.environ['PATH']}"
    name = re.search(r"file=(\S+)", info)
    if name:
        (folder / name[1]).write_text(text)
        return f"file {name[1]}"
    if language == "sql":
        rows = list(csv.reader(io.StringIO(call(["zonobench", "query", text, "--format", "csv"], folder, path))))
        if len(rows) < 2:
            raise AssertionError("no rows")
        return f"query of {len(rows) - 1} rows"
    if language == "sh" and "run" in info.split():
        call(["bash", "-euo", "pipefail", "-c", text], folder, path)
        return "commands"
    if language == "python" and "run" in info.split():
        call([options.python, "-c", text], folder, path)
        return "Python"
    return None


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--program", type=Path, required=True, help="the zonobench to run")
    parser.add_argument("--lake", type=Path, required=True, help="a lake of the default run")
    parser.add_argument("--python", default=sys.executable, help="a Python with polars, pyarrow and duckdb")
    parser.add_argument("pages", nargs="+", type=Path)
    options = parser.parse_args()
    failed = found = 0
    for page in options.pages:
        with tempfile.TemporaryDirectory() as scratch:
            folder = Path(scratch)
            (folder / "bin").mkdir()
            (folder / "bin" / "zonobench").symlink_to(options.program.resolve())
            (folder / "lake").symlink_to(options.lake.resolve())
            text = page.read_text()
            for block in FENCE.finditer(text):
                place = f"{page}:{text.count(chr(10), 0, block.start()) + 1}"
                try:
                    kind = run_block(*block.groups(), folder, options)
                except AssertionError as fault:
                    kind, failed = None, failed + 1
                    print(f"WRONG {place}: {fault}")
                if kind:
                    found += 1
                    print(f"ok    {place}: {kind}")
    print(f"{found} examples passed, {failed} failed")
    return 1 if failed or not found else 0


if __name__ == "__main__":
    sys.exit(main())
