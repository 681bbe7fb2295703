"""The pages: every public name stands in docs/python.md, its code passes mypy --strict, the stubs tell what is there."""

from __future__ import annotations

import inspect
import re
import subprocess
import sys
from pathlib import Path

import pytest

import zonobench as zb
from zonobench import _native

from conftest import ROOT

PAGE = (ROOT / "docs" / "python.md").read_text()
BLOCKS = re.findall(r"^```python run\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)


def test_every_public_name_stands_on_the_page() -> None:
    missing = [name for name in zb.__all__ if not re.search(rf"\b{name}\b", PAGE) and name != "__version__"]
    assert not missing


def test_the_pages_code_passes_mypy_strict(tmp_path: Path) -> None:
    pytest.importorskip("mypy")
    assert len(BLOCKS) >= 5
    # Examples are written without annotations of their own; what they call is checked.
    files = []
    for i, block in enumerate(BLOCKS):
        file = tmp_path / f"example_{i}.py"
        file.write_text(block)
        files.append(str(file))
    options = ["--strict", "--allow-untyped-defs", "--allow-untyped-calls", "--check-untyped-defs", "--ignore-missing-imports"]
    done = subprocess.run([sys.executable, "-m", "mypy", *options, *files], capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_stubs_name_what_is_there() -> None:
    stub = Path(_native.__file__ or "").with_name("_native.pyi").read_text()
    for name, cls in vars(_native).items():
        if name.startswith("__") or not inspect.isclass(cls) or issubclass(cls, Exception):
            continue
        body = re.search(rf"^class {name}\b.*?(?=^\S|\Z)", stub, re.MULTILINE | re.DOTALL)
        assert body, name
        for member in vars(cls):
            if not member.startswith("_"):
                assert re.search(rf"def {member}\(", body[0]), f"{name}.{member}"
        for member in re.findall(r"def (\w+)\(", body[0]):
            assert hasattr(cls, member), f"{name}.{member}"


def test_everything_public_has_a_docstring() -> None:
    for name in zb.__all__:
        if name == "__version__":
            continue
        thing = getattr(zb, name)
        assert inspect.getdoc(thing), name
        if inspect.isclass(thing):
            for member, value in vars(thing).items():
                if not member.startswith("_") and (callable(value) or inspect.isdatadescriptor(value)):
                    assert inspect.getdoc(value), f"{name}.{member}"
