"""The tables that the program wrote, as frames. Nothing is computed here."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from ._native import Error


class Lake:
    """The tables of a lake: `lake.scores`, `lake.comparison`, `lake.estimates`, ...

    Each is read when it is asked for: a polars frame where polars is installed, else a pandas frame, which needs pyarrow. Every
    table has the columns `paper` and `experiment` where it is kept by them.
    """

    def __init__(self, path: str | os.PathLike[str]):
        self.path = Path(path)
        if not self.path.is_dir():
            raise Error(f"lake: expected a folder that `zonobench` wrote, got {os.fspath(path)!r}, which is none")

    @property
    def tables(self) -> list[str]:
        """The names of the tables that are there."""
        return sorted(p.name for p in self.path.iterdir() if p.is_dir() and any(p.rglob("*.parquet")))

    def table(self, name: str, frame: str | None = None) -> Any:
        """A table as a frame. frame: "polars" or "pandas"; unless given, what is installed.

        A pandas frame has the units of its columns in ``attrs["units"]``; see `units`.
        """
        files = self._files(name)
        kind = frame or _installed()
        if kind == "polars":
            import polars

            return polars.read_parquet(self.path / name / "**/*.parquet", hive_partitioning=True)
        if kind != "pandas":
            raise Error(f'lake: expected the frame "polars" or "pandas", got {kind!r}')
        import pandas

        table = pandas.read_parquet(self.path / name)
        table.attrs["units"] = _units(files[0])
        return table

    def units(self, name: str) -> dict[str, str]:
        """The units of a table's columns, UCUM codes. Needs pyarrow."""
        return _units(self._files(name)[0])

    def _files(self, name: str) -> list[Path]:
        files = sorted((self.path / name).rglob("*.parquet")) if name.isidentifier() else []
        if not files:
            raise Error(f"lake: expected one of the tables {', '.join(self.tables)}, got {name!r}")
        return files

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        try:
            return self.table(name)
        except Error as fault:
            raise AttributeError(str(fault)) from None

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self.tables]

    def __repr__(self) -> str:
        return f"Lake({os.fspath(self.path)!r}, {len(self.tables)} tables)"


def _installed() -> str:
    from importlib.util import find_spec

    for kind in ("polars", "pandas"):
        if find_spec(kind):
            return kind
    raise ImportError("lake: the tables are read by polars or by pandas: install one of them")


def _units(file: Path) -> dict[str, str]:
    import pyarrow.parquet

    schema = pyarrow.parquet.read_schema(file)
    metadata = {field.name: field.metadata or {} for field in schema}
    return {name: of[b"unit"].decode() for name, of in metadata.items() if b"unit" in of}


def lake(path: str | os.PathLike[str]) -> Lake:
    """The lake in a folder: ``zb.lake("lake").scores``."""
    return Lake(path)
