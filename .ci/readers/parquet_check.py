"""Reads every table of a lake with DuckDB, pyarrow and polars, and says whether they find what it promises.

    python -m venv v && v/bin/pip install -r .ci/readers/requirements.txt
    v/bin/python .ci/readers/parquet_check.py lake/

Prints a line a table; exit code 1 where anything is wrong, 2 where there is nothing to read.
"""

import json
import sys
from pathlib import Path

import duckdb
import polars as pl
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

FILE_KEYS = {b"zonobench.table", b"zonobench.description", b"zonobench.schema_version", b"zonobench.license"}
UNHASHED = {"timings", "timing_comparison"}


def check(condition, *what):
    if not condition:
        raise AssertionError(" ".join(str(w) for w in what))


def path_keys(path):
    """The Hive keys of a path below the lake."""
    return dict(part.split("=", 1) for part in path.parts if "=" in part)


def check_file(lake, path, table, manifest):
    """One file alone: its manifest entry, its metadata, its page checksums. Returns its number of rows."""
    name = path.relative_to(lake).as_posix()
    file = pq.ParquetFile(path, page_checksum_verification=True)
    rows = file.read().num_rows
    check(rows == file.metadata.num_rows, name, "has", rows, "rows, its footer says", file.metadata.num_rows)
    if table not in UNHASHED:
        entry = manifest.get(name)
        check(entry, name, "is not in the manifest")
        check(entry["rows"] == rows, name, "has", rows, "rows, the manifest says", entry["rows"])
        check(entry["bytes"] == path.stat().st_size, name, "has", path.stat().st_size, "bytes")
        check(entry["table"] == table, name, "is called", entry["table"])
    metadata = file.metadata.metadata or {}
    for key in FILE_KEYS:
        check(metadata.get(key), name, "has no", key.decode())
    check(metadata[b"zonobench.table"] == table.encode(), name, "says it is", metadata[b"zonobench.table"])
    for field in file.schema_arrow:
        for key in (b"unit", b"description"):
            check((field.metadata or {}).get(key), name, field.name, "has no", key.decode())
    clash = set(path_keys(path.relative_to(lake))) & set(file.schema_arrow.names)
    check(not clash, name, "has the path's keys as columns:", clash)
    check("experiment" in path_keys(path.relative_to(lake)) or table in BY_PAPER, name, "has no experiment in its path")
    return rows


BY_PAPER = {"published", "comparison", "timing_comparison", "complexity", "claims"}


def summary_arrow(data, column):
    """(number of values, least, greatest) of a column; of the elements where it holds lists."""
    values = data[column]
    if pa.types.is_list(values.type):
        values = pa.chunked_array([pc.list_flatten(chunk) for chunk in values.chunks], values.type.value_type)
    if pa.types.is_floating(values.type):
        check(not pc.any(pc.is_nan(values)).as_py(), column, "holds NaN (pyarrow)")
    if pa.types.is_boolean(values.type):
        values = pc.cast(values, pa.int8())
    ends = pc.min_max(values).as_py()
    return len(values) - values.null_count, ends["min"], ends["max"]


def summary_duckdb(db, source, column, kind):
    quoted = f'"{column}"'
    rows = f"SELECT {quoted} AS x FROM {source}"
    if pa.types.is_list(kind):
        rows, kind = f"SELECT unnest({quoted}) AS x FROM {source}", kind.value_type
    if pa.types.is_floating(kind):
        n = db.execute(f"SELECT count(*) FROM ({rows}) WHERE isnan(x)").fetchone()[0]
        check(n == 0, column, "holds", n, "NaN (DuckDB)")
    x = "x::TINYINT" if pa.types.is_boolean(kind) else "x"
    return db.execute(f"SELECT count(x), min({x}), max({x}) FROM ({rows})").fetchone()


def summary_polars(frame, column, kind):
    x = pl.col(column)
    if pa.types.is_list(kind):
        # A null and an empty list explode into a null each, which the count leaves out.
        x, kind = x.explode(), kind.value_type
    if pa.types.is_boolean(kind):
        x = x.cast(pl.Int8)
    wanted = [x.count().alias("n"), x.min().alias("lo"), x.max().alias("hi")]
    if pa.types.is_floating(kind):
        wanted.append(x.is_nan().sum().alias("nan"))
    found = frame.select(wanted).collect().row(0)
    check(len(found) == 3 or not found[3], column, "holds NaN (polars)")
    return found[:3]


def check_table(db, lake, table, manifest):
    """All files of a table as one: three readers, with the path's keys as columns. Returns its rows."""
    folder = lake / table
    files = sorted(folder.rglob("*.parquet"))
    by_path = {}
    for path in files:
        keys = path_keys(path.relative_to(lake))
        place = tuple(keys.get(k) for k in ("paper", "experiment") if k in keys)
        by_path[place] = by_path.get(place, 0) + check_file(lake, path, table, manifest)
    keys = ["paper"] if table in BY_PAPER else ["paper", "experiment"]
    by = ", ".join(keys)

    glob = f"{folder.as_posix()}/**/*.parquet"
    source = f"read_parquet('{glob}', hive_partitioning = true)"
    # The path that pandas.read_parquet(folder) takes.
    arrow = pq.read_table(folder, partitioning="hive")
    frame = pl.scan_parquet(glob, hive_partitioning=True)

    counted = {
        "DuckDB": {tuple(r[:-1]): r[-1] for r in db.execute(f"SELECT {by}, count(*) FROM {source} GROUP BY ALL").fetchall()},
        "pyarrow": {
            tuple(str(r[k]) for k in keys): r["count_all"]
            for r in arrow.group_by(keys).aggregate([([], "count_all")]).to_pylist()
        },
        "polars": {tuple(r[:-1]): r[-1] for r in frame.group_by(keys).len().collect().rows()},
    }
    present = {place: n for place, n in by_path.items() if n > 0}
    for reader, counts in counted.items():
        check(counts == present, reader, "counts", counts, "and the files hold", present)

    columns = [f for f in pq.read_schema(files[0]) if f.name not in keys]
    for field in columns:
        found = {
            "pyarrow": tuple(summary_arrow(arrow, field.name)),
            "DuckDB": tuple(summary_duckdb(db, source, field.name, field.type)),
            "polars": tuple(summary_polars(frame, field.name, field.type)),
        }
        check(len(set(found.values())) == 1, field.name, "is read in different ways:", found)
    return sum(by_path.values()), len(files), len(columns)


def check_scores(db, lake):
    """Mean and deviation of the metrics as DuckDB computes them are those of our scores, to 1e-12."""
    source = "read_parquet('{}/{}/**/*.parquet', hive_partitioning = true)"
    metrics = source.format(lake.as_posix(), "metrics")
    scores = source.format(lake.as_posix(), "scores")
    subject = "paper, experiment, estimator, metric, component, over"
    same = " AND ".join(f"m.{k} IS NOT DISTINCT FROM s.{k}" for k in subject.split(", "))
    joined = db.execute(f"""
        SELECT s.paper, s.experiment, s.estimator, s.metric, s.component, s.n_runs, s.mean, s.sd, m.n, m.mean, m.sd, m.size
        FROM {scores} s FULL JOIN (
            SELECT {subject}, count(value) AS n, avg(value) AS mean, stddev_samp(value) AS sd, avg(abs(value)) AS size
            FROM {metrics} GROUP BY ALL
        ) m ON {same}""").fetchall()
    check(joined, "there are no scores")
    worst = 0.0
    for *what, n, mean, sd, their_n, their_mean, their_sd, size in joined:
        check(n == their_n, what, "n_runs", n, "and", their_n)
        check((mean is None) == (their_mean is None), what, "mean", mean, "and", their_mean)
        check((sd is None) == (their_sd is None), what, "sd", sd, "and", their_sd)
        for ours, theirs in ((mean, their_mean), (sd, their_sd)):
            if ours is None or ours == theirs:
                continue
            # A mean near zero of large values of both signs, or a deviation far below the mean, has no
            # digits of its own: the error is relative to the size of the values.
            worst = max(worst, abs(ours - theirs) / size)
            check(abs(ours - theirs) <= 1e-12 * size, what, "ours", ours, "DuckDB's", theirs)
    return len(joined), worst


def main():
    lake = Path(sys.argv[1] if len(sys.argv) > 1 else "lake")
    if not (lake / "MANIFEST.json").is_file():
        print(f"{lake}: no MANIFEST.json in it", file=sys.stderr)
        return 2
    manifest = {e["path"]: e for e in json.loads((lake / "MANIFEST.json").read_text())["files"]}
    tables = {e["table"] for e in manifest.values() if e["rows"] is not None}
    tables |= {t for t in UNHASHED if (lake / t).is_dir()}
    db = duckdb.connect()
    failed, total = 0, 0
    for table in sorted(tables):
        try:
            rows, files, columns = check_table(db, lake, table, manifest)
            total += rows
            print(f"ok    {table}: {rows} rows, {columns} columns, {files} files")
        except Exception as error:  # whatever a reader throws is a finding about the table
            failed += 1
            print(f"WRONG {table}: {type(error).__name__}: {error}")
    read = {p for p in manifest if manifest[p]["rows"] is not None and (lake / p).is_file()}
    missing = {p for p in manifest if manifest[p]["rows"] is not None} - read
    if missing:
        failed += 1
        print(f"WRONG manifest: {len(missing)} files are missing: {sorted(missing)[:3]}")
    try:
        scores, worst = check_scores(db, lake)
        print(f"ok    scores against metrics in DuckDB: {scores} scores, largest relative difference {worst:.1e}")
    except Exception as error:
        failed += 1
        print(f"WRONG scores against metrics: {type(error).__name__}: {error}")
    print(f"{len(tables)} tables, {total} rows, {failed} wrong")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
