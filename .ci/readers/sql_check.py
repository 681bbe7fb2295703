#!/usr/bin/env python3
"""Puts the same statements to `zonobench query` and to DuckDB and says where they give other rows.

    python -m venv v && v/bin/pip install -r .ci/readers/requirements.txt
    v/bin/python .ci/readers/sql_check.py target/debug/zonobench lake-quick/          the statements
    v/bin/python .ci/readers/sql_check.py target/debug/zonobench lake/ --times        five statements, timed

The statements come from a grammar over the lake's tables and a fixed seed: the same ones for the same lake.
Rows are compared as multisets: integers and texts exactly, floats to 1e-9 of the greater. A statement that is
refused (exit code 2, with a reason) is no wrong answer; what is refused is printed, and may be few. Exit code 1
where an answer differs, 2 where there is nothing to ask.
"""

import argparse
import json
import math
import os
import random
import subprocess
import sys
import tempfile
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import duckdb

SEED = 16
TOLERANCE = 1e-9
# A refusal is honest, and of no use: more than one in twenty would be a poor SQL.
REFUSED = 0.05
TABLES = {
    "variables": 2, "truth": 2, "measurements": 2, "inputs": 2, "estimators": 2, "estimates": 2, "beliefs": 2,
    "sets": 2, "metrics": 2, "scores": 2, "published": 1, "comparison": 1, "claims": 1, "complexity": 1,
}


# ---- the lake in DuckDB


def connect(lake):
    """The lake's tables as views, their keys as texts."""
    db = duckdb.connect()
    columns = {}
    for table in TABLES:
        files = f"{lake}/{table}/**/*.parquet"
        if not any((lake / table).rglob("*.parquet")):
            continue
        db.execute(
            f"CREATE VIEW {table} AS SELECT * FROM read_parquet('{files}', hive_partitioning = true, hive_types_autocast = false)"
        )
        columns[table] = [(name, kind) for name, kind, *_ in db.execute(f"DESCRIBE SELECT * FROM {table}").fetchall()]
    return db, columns


def plain(value):
    """A value of DuckDB as one of JSON."""
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    if isinstance(value, (list, tuple)):
        return [plain(v) for v in value]
    if type(value).__name__ == "Decimal":
        return int(value) if value == value.to_integral_value() else float(value)
    return str(value)


# ---- comparing rows


def number(value):
    """The number that a value of ours is: JSON has no infinity."""
    if isinstance(value, str) and value in ("inf", "-inf", "NaN"):
        return float(value)
    return value


def same(ours, theirs):
    if isinstance(theirs, list):
        return isinstance(ours, list) and len(ours) == len(theirs) and all(map(same, ours, theirs))
    if isinstance(theirs, bool) or theirs is None:
        return ours is theirs
    if isinstance(theirs, (int, float)):
        ours = number(ours)
        if isinstance(ours, bool) or not isinstance(ours, (int, float)):
            return False
        if isinstance(ours, int) and isinstance(theirs, int):
            return ours == theirs
        if math.isnan(theirs) or math.isnan(ours):
            return math.isnan(theirs) and math.isnan(ours)
        if math.isinf(theirs) or math.isinf(ours):
            return theirs == ours
        # What is left of numbers that cancel has no digits to compare.
        return abs(ours - theirs) <= TOLERANCE * max(abs(ours), abs(theirs), 1e-6)
    return ours == theirs


def order(row):
    """Rows of which floats may differ in the last digits, in an order that does not see them."""
    def key(value):
        value = number(value)
        if value is None:
            return (0, "")
        if isinstance(value, bool):
            return (1, value)
        if isinstance(value, (int, float)):
            if math.isnan(value):
                return (3, "nan")
            if math.isinf(value) or value == 0:
                return (2, float(value) + 0.0)
            return (2, float(f"{value:.6e}"))
        return (4, json.dumps(value))
    return [key(v) for v in row]


def rows_differ(ours, theirs):
    """None, or what is other."""
    if len(ours) != len(theirs):
        return f"{len(ours)} rows, DuckDB {len(theirs)}"
    ours, theirs = sorted(ours, key=order), sorted(theirs, key=order)
    # Rounding to six digits may sort neighbours otherwise: look for each row's own partner then.
    alike = lambda a, b: len(a) == len(b) and all(map(same, a, b))
    pairs = [(a, b) for a, b in zip(ours, theirs) if not alike(a, b)]
    ours, left = [a for a, _ in pairs], [b for _, b in pairs]
    if len(ours) > 2000:
        return f"{len(ours)} rows differ, such as {ours[0]}; DuckDB {left[0]}"
    for row in ours:
        partner = next((i for i, other in enumerate(left) if alike(row, other)), None)
        if partner is None:
            return f"{row}, DuckDB has {left[0]}"
        left.pop(partner)
    return None


# ---- the grammar


class Grammar:
    def __init__(self, db, columns):
        self.random = random.Random(SEED)
        self.db, self.columns = db, columns
        # Enough of each table for a join of any kind, and no more.
        self.small = [t for t in columns if db.execute(f"SELECT count(*) FROM {t}").fetchone()[0] <= 20_000]
        self.values = {}

    def pick(self, items):
        return self.random.choice(list(items))

    def chance(self, p):
        return self.random.random() < p

    def of(self, table, kinds):
        """The columns of a table that are of these kinds: number, integer, text, boolean."""
        def fits(kind):
            integer = kind in ("INTEGER", "BIGINT")
            return (
                ("integer" in kinds and integer)
                or ("number" in kinds and (integer or kind == "DOUBLE"))
                or ("text" in kinds and kind == "VARCHAR")
                or ("boolean" in kinds and kind == "BOOLEAN")
            )
        return [name for name, kind in self.columns[table] if fits(kind)]

    def value(self, table, column):
        """A literal of a value that the column has, or is near one that it has."""
        key = (table, column)
        if key not in self.values:
            found = self.db.execute(
                f'SELECT DISTINCT "{column}" AS v FROM {table} WHERE "{column}" IS NOT NULL ORDER BY v LIMIT 40'
            ).fetchall()
            self.values[key] = [v for (v,) in found]
        values = self.values[key]
        if not values:
            return "NULL"
        return self.literal(self.pick(values))

    def literal(self, v):
        if isinstance(v, bool):
            return "TRUE" if v else "FALSE"
        if isinstance(v, str):
            return "'" + v.replace("'", "''") + "'"
        if isinstance(v, int):
            return self.pick([str(v), str(v), f"{v}.0", f"{v}e0", f"CAST({v} AS BIGINT)", f"({v})"])
        if math.isinf(v) or math.isnan(v):
            return f"CAST('{v}' AS DOUBLE)"
        return self.pick([repr(v), f"{v:e}", f"{v:.3E}", f"CAST({v!r} AS DOUBLE)", f"({v!r} + 0)"])

    def table(self, kinds=()):
        """A small table that has columns of each of these kinds."""
        fitting = [t for t in self.small if all(self.of(t, [k]) for k in kinds)]
        return self.pick(fitting)

    # expressions over an aliased table; `a` is the alias with its dot, or empty

    def column(self, table, kinds, a=""):
        return f'{a}"{self.pick(self.of(table, kinds))}"'

    def number(self, table, a="", depth=2):
        r = self.random.random()
        if depth == 0 or r < 0.35:
            return self.column(table, ["number"], a)
        x = lambda: self.number(table, a, depth - 1)
        return self.pick([
            lambda: f"({x()} + {x()})",
            lambda: f"({x()} - {x()})",
            lambda: f"{x()} * {self.pick(['2', '0.5', '1e-3', '1E2', '-3', '.25'])}",
            lambda: f"{x()} / {self.pick(['3', '7.0', '1e3', '-4'])}",
            lambda: f"ABS({x()})",
            lambda: f"ROUND({x()}, {self.pick(['0', '1', '3'])})",
            lambda: f"FLOOR({x()})",
            lambda: f"CEIL({x()})",
            lambda: f"-{self.column(table, ['number'], a)}",
            lambda: f"COALESCE({x()}, {self.pick(['0', '-1.5', '1e6'])})",
            lambda: f"NULLIF({self.column(table, ['number'], a)}, {self.pick(['0', '1', '2'])})",
            lambda: f"CASE WHEN {self.condition(table, a, depth - 1)} THEN {x()} ELSE {x()} END",
            lambda: f"GREATEST({x()}, {x()})",
            lambda: f"LEAST({x()}, {self.pick(['0', '1', '10'])})",
            lambda: f"CAST({x()} AS DOUBLE)",
            lambda: f"SQRT(ABS({x()}))",
            lambda: f"SIGN({x()})",
            lambda: f"({self.column(table, ['integer'], a)} % {self.pick(['2', '3', '5'])})"
            if self.of(table, ["integer"]) else x(),
            lambda: f"CAST(ROUND(LEAST(GREATEST({x()}, -1000), 1000)) AS BIGINT)",
        ])()

    def text(self, table, a="", depth=2):
        if depth == 0 or self.chance(0.4):
            return self.column(table, ["text"], a)
        x = lambda: self.text(table, a, depth - 1)
        return self.pick([
            lambda: f"UPPER({x()})",
            lambda: f"LOWER({x()})",
            lambda: f"({x()} || '-' || {x()})",
            lambda: f"SUBSTRING({x()}, {self.pick(['1, 2', '2, 3', '1, 4'])})",
            lambda: f"REPLACE({x()}, 'e', '3')",
            lambda: f"CONCAT({x()}, '/', {x()})",
            lambda: f"TRIM({x()})",
            lambda: f"COALESCE({x()}, 'none')",
            lambda: f"CASE WHEN {self.condition(table, a, depth - 1)} THEN {x()} ELSE 'other' END",
            lambda: f"LEFT({x()}, 3)",
            lambda: f"REVERSE({x()})",
        ])()

    def condition(self, table, a="", depth=2):
        kinds = [k for k in ("number", "text", "boolean") if self.of(table, [k])]
        if depth > 0 and self.chance(0.45):
            x = lambda: self.condition(table, a, depth - 1)
            return self.pick([
                lambda: f"({x()} AND {x()})",
                lambda: f"({x()} OR {x()})",
                lambda: f"NOT ({x()})",
                lambda: f"(({x()}) IS TRUE)",
                lambda: f"(({x()}) IS NOT FALSE)",
            ])()
        kind = self.pick(kinds)
        name = self.pick(self.of(table, [kind]))
        c, v = f'{a}"{name}"', lambda: self.value(table, name)
        if kind == "boolean":
            return self.pick([c, f"NOT {c}", f"{c} IS NULL", f"{c} = TRUE", f"{c} IS NOT TRUE"])
        shapes = [
            lambda: f"{c} {self.pick(['=', '<>', '!=', '<', '<=', '>', '>='])} {v()}",
            lambda: f"{v()} {self.pick(['<', '>=', '='])} {c}",
            lambda: f"{c} BETWEEN {v()} AND {v()}",
            lambda: f"{c} NOT BETWEEN {v()} AND {v()}",
            lambda: f"{c} IN ({v()}, {v()}, {v()})",
            lambda: f"{c} NOT IN ({v()}, {v()})",
            lambda: f"{c} IN ({v()}, NULL)",
            lambda: f"{c} IS NULL",
            lambda: f"{c} IS NOT NULL",
            lambda: f"{c} IS DISTINCT FROM {v()}",
            lambda: f"{c} IS NOT DISTINCT FROM {v()}",
        ]
        if kind == "text":
            shapes += [
                lambda: f"{c} LIKE '{self.pick(['b%', '%e%', '_o%', '%x', 'z%'])}'",
                lambda: f"{c} NOT LIKE '%a%'",
                lambda: f"{c} ILIKE '%E%'",
                lambda: f"LENGTH({c}) > {self.pick(['3', '5', '8'])}",
                lambda: f"STARTS_WITH({c}, 'e')",
            ]
        else:
            shapes += [
                lambda: f"ABS({c}) < {self.pick(['1e-3', '1', '1e6', '0.1'])}",
                lambda: f"{self.number(table, a, 1)} > {self.number(table, a, 1)}",
            ]
        return self.pick(shapes)()

    def aggregate(self, table, a="", floats=True):
        n = lambda: self.number(table, a, 1) if self.of(table, ["number"]) else f"LENGTH({self.text(table, a, 0)})"
        anything = lambda: self.column(table, ["number", "text"], a)
        shapes = [
            lambda: "COUNT(*)",
            lambda: f"COUNT({anything()})",
            lambda: f"COUNT(DISTINCT {anything()})",
            lambda: f"MIN({anything()})",
            lambda: f"MAX({anything()})",
            lambda: f"COUNT(*) FILTER (WHERE {self.condition(table, a, 1)})",
            lambda: f"SUM(CASE WHEN {self.condition(table, a, 1)} THEN 1 ELSE 0 END)",
        ]
        if floats:
            finite = lambda: f"CASE WHEN ABS({n()}) < 1e6 THEN {n()} END"
            shapes += [
                lambda: f"SUM({finite()})",
                lambda: f"AVG({finite()})",
                lambda: f"MEDIAN({n()})",
                lambda: f"AVG({finite()}) FILTER (WHERE {self.condition(table, a, 1)})",
                lambda: f"BOOL_OR({self.condition(table, a, 0)})",
                lambda: f"BOOL_AND({self.condition(table, a, 0)})",
            ]
        return self.pick(shapes)()

    # statements

    def literals(self):
        """Numbers, texts and casts in every form."""
        forms = [
            "0", "-1", "+3", "42", "2147483648", "9007199254740993", "1.5", "-0.25", ".5", "5.", "1e-3", "1E6", "1.5e+3",
            "2e0", "1e-300", "1.7e308", "-1e-9", "'it''s'", "''", "'ünï'", "'a' || 'b'", "TRUE", "FALSE", "NULL",
            "7 / 2", "-7 / 2", "7 // 2", "7 % 3", "-7 % 3", "7.5 % 2", "1 / 3.0", "2 + 3 * 4", "(2 + 3) * 4", "10 - 4 - 3",
            "2 = 2.0", "1e0 = 1", "'a' < 'b'", "'B' < 'a'", "NULL = NULL", "NULL IS NULL", "1 IN (1, NULL)", "2 IN (1, NULL)",
            "2 NOT IN (1, NULL)", "TRUE AND NULL", "FALSE AND NULL", "TRUE OR NULL", "NOT NULL", "5 BETWEEN 1 AND 10",
            "5 BETWEEN 10 AND 1", "CAST('12' AS INTEGER)", "CAST('1e-3' AS DOUBLE)", "CAST(2.5 AS INTEGER)",
            "CAST(3.5 AS INTEGER)", "CAST(-2.5 AS BIGINT)", "CAST(CAST(2.7 AS DOUBLE) AS BIGINT)", "12::VARCHAR",
            "'3'::INTEGER + 1", "TRUE::INTEGER", "CAST(1 AS BOOLEAN)", "1.5::VARCHAR", "CAST(0.1 AS DOUBLE) + 0.2",
            "COALESCE(NULL, 3)", "NULLIF(1, 1)", "CASE WHEN NULL THEN 1 ELSE 2 END", "CASE 3 WHEN 3 THEN 'x' END",
            "ROUND(2.5)", "ROUND(-2.5)", "ROUND(1234.567, 1)", "ROUND(1234.567, -2)", "FLOOR(-0.5)", "CEIL(-0.5)", "ABS(-3)",
            "POWER(2, 10)", "SQRT(2.0)", "EXP(1.0)", "LN(10.0)", "LOG10(1000.0)", "SIGN(-0.0)", "GREATEST(1, 2.5, NULL)",
            "LEAST('b', 'a')", "LENGTH('ünï')", "UPPER('abc')", "SUBSTRING('abcdef', 2, 3)", "REPLACE('aXa', 'X', '-')",
            "TRIM('  x ')", "LTRIM(' x')", "RTRIM('x ')", "LPAD('7', 3, '0')", "RPAD('7', 3, 'x')", "REPEAT('ab', 3)",
            "CONCAT('a', NULL, 'b')", "'a' || NULL", "CONCAT_WS('-', 'a', 'b')", "STRPOS('abc', 'c')", "LEFT('abc', 2)",
            "RIGHT('abc', 2)", "REVERSE('abc')", "SPLIT_PART('a-b-c', '-', 2)", "STARTS_WITH('abc', 'ab')", "CHR(65)",
            "ASCII('A')", "'a_c' LIKE 'a_c'", "'abc' LIKE 'a_c'", "'ABC' ILIKE 'a%'", "'abc' NOT LIKE '%d%'", "1 <> 2", "1 != 2",
            "1 / 0", "1 % 0", "1.0 / 0.0", "0 = -0.0", "CAST('inf' AS DOUBLE) > 1e308", "CAST('nan' AS DOUBLE) = CAST('nan' AS DOUBLE)",
            "1 IS DISTINCT FROM NULL", "NULL IS NOT DISTINCT FROM NULL", "[1, 2, 3]", "[1, 2, 3][2]", "ARRAY_LENGTH([1, 2, 3])",
            "DATE '2000-01-01'", "PI()",
        ]
        at = 0
        while at < len(forms):
            yield f"SELECT {forms[at]} AS a"
            at += 1

    def filters(self):
        t = self.table()
        columns = [self.column(t, ["number", "text", "boolean"]) for _ in range(3)]
        named = ", ".join(f"{c} AS c{i}" for i, c in enumerate(columns))
        return f"SELECT {named} FROM {t} WHERE {self.condition(t, depth=3)}"

    def projections(self):
        t = self.table(["number", "text"])
        return f"SELECT {self.number(t, depth=3)} AS a, {self.text(t)} AS b, {self.condition(t)} AS c FROM {t} WHERE {self.condition(t, depth=1)}"

    def groups(self):
        t = self.table(["number", "text"])
        keys = [self.pick([self.column(t, ["text", "integer", "boolean"]), self.text(t, depth=1)]) for _ in range(self.pick([1, 2]))]
        named = ", ".join(f"{k} AS k{i}" for i, k in enumerate(keys))
        folded = ", ".join(f"{self.aggregate(t)} AS a{i}" for i in range(3))
        where = f" WHERE {self.condition(t)}" if self.chance(0.5) else ""
        by = self.pick([", ".join(keys), ", ".join(str(i + 1) for i in range(len(keys)))])
        having = f" HAVING {self.pick(['COUNT(*) > 1', self.aggregate(t, floats=False) + ' IS NOT NULL', 'COUNT(*) BETWEEN 2 AND 1e3'])}" if self.chance(0.5) else ""
        return f"SELECT {named}, {folded} FROM {t}{where} GROUP BY {by}{having}"

    def whole(self):
        t = self.table(["number", "text"])
        folded = ", ".join(f"{self.aggregate(t)} AS a{i}" for i in range(4))
        return f"SELECT {folded} FROM {t} WHERE {self.condition(t)}"

    def rollups(self):
        t = self.table(["number", "text"])
        a, b = self.random.sample(self.of(t, ["text"]), 2) if len(self.of(t, ["text"])) > 1 else (self.of(t, ["text"])[0],) * 2
        kind = self.pick([f'ROLLUP ("{a}", "{b}")', f'CUBE ("{a}", "{b}")', f'GROUPING SETS (("{a}"), ("{b}"), ())'])
        return f'SELECT "{a}" AS a, "{b}" AS b, COUNT(*) AS n, {self.aggregate(t, floats=False)} AS m FROM {t} GROUP BY {kind}'

    def join_condition(self, left, right):
        """What stands after ON: equalities, constants of either side, comparisons, ranges, alternatives."""
        shared = [n for n, k in self.columns[left] if (n, k) in self.columns[right] and k != "DOUBLE[]"]
        equal = [f'l."{n}" = r."{n}"' for n in self.random.sample(shared, min(len(shared), self.pick([2, 3, 4])))]
        others = [
            lambda: self.condition(left, "l.", 0),
            lambda: self.condition(right, "r.", 0),
            lambda: f"{self.number(left, 'l.', 0)} {self.pick(['<', '<=', '>', '<>'])} {self.number(right, 'r.', 0)}",
            lambda: f"{self.number(left, 'l.', 0)} BETWEEN {self.number(right, 'r.', 0)} - 1 AND {self.number(right, 'r.', 0)} + 1e0",
            lambda: f"({self.condition(left, 'l.', 0)} OR {self.condition(right, 'r.', 0)})",
            lambda: f'(l."{shared[0]}" = r."{shared[0]}" OR {self.condition(right, "r.", 0)})',
            lambda: self.pick(["TRUE", "1 = 1", "1 = 0", "NULL"]),
        ]
        parts = equal[: self.pick([0, 1, 2, 3, 4])] + [self.pick(others)() for _ in range(self.pick([0, 1, 1, 2]))]
        return " AND ".join(parts or ["l.paper = r.paper"])

    def joins(self):
        left, right = self.table(["number", "text"]), self.table(["number", "text"])
        kind = self.pick(["JOIN", "INNER JOIN", "LEFT JOIN", "RIGHT JOIN", "FULL JOIN", "LEFT OUTER JOIN", "FULL OUTER JOIN"])
        l, r = self.cut(left), self.cut(right)
        folded = f'COUNT(*) AS n, COUNT(l.paper) AS a, COUNT(r.paper) AS b, MIN({self.text(left, "l.", 0)}) AS c, ' \
                 f'MAX({self.number(right, "r.", 0)}) AS d, COUNT(DISTINCT {self.column(right, ["text"], "r.")}) AS e'
        return f"SELECT {folded} FROM {l} l {kind} {r} r ON {self.join_condition(left, right)}"

    def cut(self, table):
        """A few rows of a table, the same for both: by what they hold, not by their order."""
        count = self.db.execute(f"SELECT count(*) FROM {table}").fetchone()[0]
        if count <= 400:
            return table
        name = self.pick([n for n in self.of(table, ["text"])])
        text = self.value(table, name)
        less = self.of(table, ["integer"])
        more = f' AND "{self.pick(less)}" <= {self.pick([1, 2, 3])}' if less and count > 2000 else ""
        rows = f'(SELECT * FROM {table} WHERE "{name}" = {text}{more})'
        n = self.db.execute(f"SELECT count(*) FROM {rows}").fetchone()[0]
        return rows if n <= 3000 else f'(SELECT * FROM {table} WHERE paper = \'box\' AND "{name}" = {text}{more})'

    def join_rows(self):
        left, right = self.table(["number", "text"]), self.table(["number", "text"])
        kind = self.pick(["LEFT JOIN", "RIGHT JOIN", "FULL JOIN", "JOIN"])
        shared = [n for n, k in self.columns[left] if (n, k) in self.columns[right] and k == "VARCHAR"]
        using = self.pick([f'USING ({", ".join(chr(34) + n + chr(34) for n in shared)})', "ON " + " AND ".join(f'l."{n}" = r."{n}"' for n in shared) + " AND " + self.pick([self.condition(left, "l.", 0), self.condition(right, "r.", 0)])])
        return f'SELECT l.paper AS p, {self.column(left, ["number", "text"], "l.")} AS a, {self.column(right, ["number", "text"], "r.")} AS b FROM {self.cut(left)} l {kind} {self.cut(right)} r {using}'

    def using(self):
        left, right = self.table(["number", "text"]), self.table(["number", "text"])
        shared = [n for n, k in self.columns[left] if (n, k) in self.columns[right] and k == "VARCHAR"]
        keys = self.random.sample(shared, self.pick(range(1, len(shared) + 1)))
        kind = self.pick(["JOIN", "LEFT JOIN", "RIGHT JOIN", "FULL JOIN", "SEMI JOIN", "ANTI JOIN"])
        named = ", ".join(f'"{k}"' for k in keys)
        test = self.pick(["IS NOT NULL", "< 'm'"])
        where = f' WHERE "{self.pick(keys)}" {test}' if self.chance(0.5) else ""
        return f"SELECT {named}, COUNT(*) AS n FROM {self.cut(left)} x {kind} {self.cut(right)} m USING ({named}){where} GROUP BY {named}"

    def semi(self):
        left, right = self.table(["number", "text"]), self.table(["number", "text"])
        kind = self.pick(["SEMI", "ANTI"])
        return f'SELECT COUNT(*) AS n, MIN({self.text(left, "l.", 0)}) AS a FROM {self.cut(left)} l {kind} JOIN {self.cut(right)} r ON {self.join_condition(left, right)}'

    def commas(self):
        left, right = self.table(["number", "text"]), self.table(["number", "text"])
        shared = [n for n, k in self.columns[left] if (n, k) in self.columns[right] and k == "VARCHAR"]
        where = " AND ".join(f'l."{n}" = r."{n}"' for n in shared[: self.pick([1, 2, 3])])
        return f'SELECT COUNT(*) AS n, SUM({self.column(left, ["integer"], "l.") if self.of(left, ["integer"]) else "1"}) AS s, MAX({self.text(right, "r.", 0)}) AS m FROM {self.cut(left)} l, {self.cut(right)} r WHERE {where} AND {self.condition(right, "r.", 1)}'

    def three(self):
        a = self.table(["number", "text"])
        b, c = self.table(["text"]), self.table(["text"])
        kinds = self.random.choices(["JOIN", "LEFT JOIN"], k=2)
        return f"SELECT COUNT(*) AS n, COUNT(y.paper) AS m, COUNT(DISTINCT z.paper) AS o FROM {self.cut(a)} x {kinds[0]} (SELECT DISTINCT paper FROM {b}) y ON x.paper = y.paper {kinds[1]} (SELECT DISTINCT paper FROM {c} WHERE {self.condition(c, depth=0)}) z ON y.paper = z.paper"

    def windows(self):
        t = self.table(["number", "text"])
        ordered = ", ".join(f'"{n}"{self.pick(["", " ASC", " DESC", " NULLS FIRST", " DESC NULLS LAST"])}' for n, k in self.columns[t] if not k.endswith("[]"))
        by = f'PARTITION BY {self.column(t, ["text"])}' if self.chance(0.7) else ""
        frame = self.pick(["", "ROWS BETWEEN 2 PRECEDING AND CURRENT ROW", "ROWS BETWEEN UNBOUNDED PRECEDING AND UNBOUNDED FOLLOWING", "ROWS BETWEEN 1 PRECEDING AND 1 FOLLOWING"])
        n, few = self.column(t, ["number"]), self.column(t, ["text"])
        over = f"OVER ({by} ORDER BY {ordered})"
        framed = f"OVER ({by} ORDER BY {ordered} {frame})"
        function = self.pick([
            f"ROW_NUMBER() {over}", f"RANK() OVER ({by} ORDER BY {n})", f"DENSE_RANK() OVER ({by} ORDER BY {few} DESC)",
            f"LAG({n}) {over}", f"LEAD({n}, 2, 0) {over}", f"FIRST_VALUE({n}) {over}", f"LAST_VALUE({few}) {framed}",
            f"COUNT(*) {framed}", f"MIN({n}) {framed}", f"MAX({n}) {framed}", f"NTILE(4) {over}",
            f"COUNT({n}) OVER ({by} ORDER BY {few})", f"PERCENT_RANK() OVER ({by} ORDER BY {n})", f"CUME_DIST() OVER ({by} ORDER BY {n})",
            f"SUM(CASE WHEN ABS({n}) < 1e3 THEN {n} END) {framed}", f"AVG(CASE WHEN ABS({n}) < 1e3 THEN {n} END) {framed}",
        ])
        return f'SELECT {few} AS a, {n} AS b, {function} AS w FROM {self.cut(t)} AS t'

    def ctes(self):
        t = self.table(["number", "text"])
        key = self.pick(self.of(t, ["text"]))
        return self.pick([
            lambda: f'WITH a AS (SELECT "{key}" AS k, COUNT(*) AS n FROM {t} GROUP BY 1), b AS (SELECT MAX(n) AS m FROM a) SELECT k, n, m, n = m AS most FROM a, b WHERE n * 2 >= m',
            lambda: f'WITH a AS (SELECT * FROM {t} WHERE {self.condition(t)}), b AS (SELECT * FROM {t} WHERE {self.condition(t)}) SELECT (SELECT COUNT(*) FROM a) AS x, (SELECT COUNT(*) FROM b) AS y',
            lambda: f'WITH RECURSIVE r AS (SELECT 1 AS i UNION ALL SELECT i + 1 FROM r WHERE i < {self.pick([5, 10, 30])}) SELECT i, i * i AS s, (SELECT COUNT(*) FROM {t}) + i AS n FROM r',
            lambda: f'WITH a(k, n) AS (SELECT "{key}", COUNT(*) FROM {t} GROUP BY "{key}") SELECT x.k, y.n FROM a x LEFT JOIN a y ON x.k = y.k AND y.n > {self.pick([1, 5, 20])}',
        ])()

    def subqueries(self):
        t, o = self.table(["number", "text"]), self.table(["number", "text"])
        shared = [n for n, k in self.columns[t] if (n, k) in self.columns[o] and k == "VARCHAR"]
        name = self.pick(shared)
        n, m = self.pick(self.of(t, ["number"])), self.pick(self.of(o, ["number"]))
        cut, other = self.cut(t), self.cut(o)
        return self.pick([
            lambda: f'SELECT COUNT(*) AS n FROM {cut} x WHERE EXISTS (SELECT 1 FROM {other} y WHERE y."{name}" = x."{name}" AND {self.condition(o, "y.", 0)})',
            lambda: f'SELECT COUNT(*) AS n FROM {cut} x WHERE NOT EXISTS (SELECT * FROM {other} y WHERE y."{name}" = x."{name}" AND {self.condition(o, "y.", 0)})',
            lambda: f'SELECT COUNT(*) AS n FROM {cut} x WHERE "{name}" IN (SELECT "{name}" FROM {o} WHERE {self.condition(o)})',
            lambda: f'SELECT COUNT(*) AS n FROM {cut} x WHERE "{name}" NOT IN (SELECT "{name}" FROM {o} WHERE {self.condition(o)})',
            lambda: f'SELECT COUNT(*) AS n FROM {cut} x WHERE x."{n}" NOT IN (SELECT "{m}" FROM {other} AS y)',
            lambda: f'SELECT COUNT(*) AS n FROM {cut} x WHERE x."{n}" IN (SELECT "{m}" FROM {other} AS y)',
            lambda: f'SELECT COUNT(*) AS n FROM {cut} x WHERE "{n}" > (SELECT AVG("{m}") FROM {o} WHERE ABS("{m}") < 1e6)',
            lambda: f'SELECT "{name}" AS a, (SELECT MAX("{m}") FROM {other} y WHERE y."{name}" = x."{name}") AS b FROM {cut} x',
            lambda: f'SELECT "{name}" AS a, (SELECT COUNT(*) FROM {other} y WHERE y."{name}" = x."{name}" AND {self.condition(o, "y.", 0)}) AS b FROM {cut} x',
            lambda: f'SELECT "{name}" AS a, COUNT(*) AS n FROM {t} GROUP BY 1 HAVING COUNT(*) >= (SELECT COUNT(*) / 10 FROM {t})',
            lambda: f'SELECT s.a, COUNT(*) AS n FROM (SELECT "{name}" AS a FROM {t} WHERE {self.condition(t)}) s GROUP BY s.a',
            lambda: f'SELECT COUNT(*) AS n FROM {cut} x WHERE x."{n}" >= ALL (SELECT "{m}" FROM {other} AS y WHERE "{m}" IS NOT NULL)',
            lambda: f'SELECT COUNT(*) AS n FROM {cut} x WHERE x."{n}" = ANY (SELECT "{m}" FROM {other} AS y)',
            lambda: f'SELECT x."{name}" AS a, l.m FROM (SELECT DISTINCT "{name}" FROM {t}) x, LATERAL (SELECT MAX("{m}") AS m FROM {other} y WHERE y."{name}" = x."{name}") l',
        ])()

    def sets(self):
        t, o = self.table(["text"]), self.table(["text"])
        a, b = self.pick(self.of(t, ["text"])), self.pick(self.of(o, ["text"]))
        kind = self.pick(["UNION", "UNION ALL", "INTERSECT", "EXCEPT"])
        return f'SELECT "{a}" AS a FROM {t} WHERE {self.condition(t, depth=1)} {kind} SELECT "{b}" FROM {o} WHERE {self.condition(o, depth=1)}'

    def distinct(self):
        t = self.table(["number", "text"])
        return self.pick([
            lambda: f"SELECT DISTINCT {self.text(t)} AS a, {self.condition(t, depth=0)} AS b FROM {t}",
            lambda: f'SELECT COUNT(*) AS n FROM (SELECT DISTINCT {self.column(t, ["text"])} AS a, {self.column(t, ["number"])} AS b FROM {t}) s',
            lambda: f'SELECT SUM(DISTINCT {self.column(t, ["integer"])}) AS a, COUNT(DISTINCT paper) AS b FROM {t}' if self.of(t, ["integer"]) else f"SELECT DISTINCT paper FROM {t}",
        ])()

    def top(self):
        t = self.table(["number", "text"])
        # All columns: rows that tie are equal.
        names = [n for n, k in self.columns[t] if not k.endswith("[]")]
        self.random.shuffle(names)
        by = ", ".join(f'"{n}"{self.pick(["", " DESC", " ASC NULLS FIRST", " DESC NULLS LAST"])}' for n in names)
        shown = ", ".join(f'"{n}"' for n in names)
        return f"SELECT {shown} FROM {t} WHERE {self.condition(t, depth=1)} ORDER BY {by} LIMIT {self.pick([1, 7, 30])}{self.pick(['', ' OFFSET 3', ' OFFSET 100000'])}"

    def lists(self):
        return self.pick([
            'SELECT COUNT(*) AS n, SUM(covariance[1]) AS a FROM beliefs WHERE k <= 2 AND covariance[1] < 1e6',
            'SELECT estimator, k, covariance FROM beliefs WHERE run = 0 AND k = 1 AND paper = \'ezgkf\'',
            'SELECT estimator, MAX(LENGTH(generators)) AS n FROM sets GROUP BY estimator',
            'SELECT estimator, COUNT(*) AS n FROM (SELECT estimator, UNNEST(center) AS c FROM sets) s WHERE c > 0 GROUP BY estimator',
            'SELECT kind, center[1] AS x, vertices FROM sets WHERE k <= 1 AND run = 0 AND vertices IS NOT NULL',
        ])

    def fixed(self):
        """What went wrong in the field, and what is near it."""
        yield from [
            "SELECT COUNT(*) AS n, SUM(t.run) AS a, SUM(e.run) AS b FROM truth t JOIN estimates e ON t.paper = e.paper AND t.experiment = e.experiment AND t.k = e.k AND t.component = e.component AND e.run = 0 WHERE t.paper = 'box'",
            "SELECT COUNT(*) AS n FROM truth t, estimators e WHERE t.paper = e.paper AND t.experiment = e.experiment AND t.paper = 'box'",
            "SELECT COUNT(*) AS n FROM estimates WHERE ABS(center) < 1e-3",
            "SELECT 1.0e-300 AS a, 1.7e308 AS b",
            "SELECT COUNT(*) AS n FROM scores s LEFT JOIN metrics m ON s.paper = m.paper AND s.metric = m.metric AND m.value > s.mean",
            "SELECT COUNT(*) AS n FROM scores s RIGHT JOIN estimators m ON s.paper = m.paper AND s.n_runs > 1",
            "SELECT COUNT(*) AS n FROM estimators s FULL JOIN estimators m ON s.paper = m.paper AND s.estimator < m.estimator",
            "SELECT COUNT(*) AS n FROM estimators s SEMI JOIN scores m ON s.paper = m.paper AND s.estimator = m.estimator AND m.mean > 1",
            "SELECT COUNT(*) AS n FROM estimators s ANTI JOIN scores m ON s.paper = m.paper AND s.estimator = m.estimator AND m.mean > 1",
            "SELECT paper, estimator, AVG(upper - lower) AS w FROM estimates WHERE upper - lower < 1e9 GROUP BY paper, estimator",
            "SELECT k, k FROM truth WHERE paper = 'box' AND run = 0",
            "SELECT t.k, m.k FROM truth t JOIN measurements m USING (paper, experiment, run) WHERE t.k <= 1 AND m.k <= 1 AND run = 0",
            "SELECT paper, COUNT(*) AS n, COUNT(c.claim) AS a FROM (SELECT * FROM claims WHERE paper < 'c') c FULL JOIN (SELECT * FROM published WHERE paper > 'b') p USING (paper) GROUP BY paper",
            "SELECT paper, estimator, kind, mean FROM (SELECT * FROM estimators WHERE kind = 'kalman') e RIGHT JOIN scores s USING (paper, experiment, estimator) WHERE paper <> 'cz'",
            "SELECT * FROM (SELECT DISTINCT paper, estimator FROM scores) s LEFT JOIN (SELECT DISTINCT paper, unit FROM published) p USING (paper)",
            "SELECT * FROM (SELECT DISTINCT paper, estimator FROM scores) s LEFT JOIN (SELECT DISTINCT unit, paper FROM published WHERE paper > 'c') p USING (paper)",
            "SELECT * FROM (SELECT DISTINCT paper FROM scores) s JOIN (SELECT DISTINCT claim, paper FROM claims) c USING (paper) LEFT JOIN (SELECT paper, MAX(size) AS m FROM complexity GROUP BY paper) x USING (paper)",
            "SELECT paper, COUNT(*) AS n FROM estimators NATURAL JOIN (SELECT DISTINCT paper, experiment, estimator FROM scores WHERE mean > 1) s GROUP BY paper",
            "SELECT paper, a.n, b.n, c.n FROM (SELECT paper, COUNT(*) AS n FROM claims GROUP BY paper) a FULL JOIN (SELECT paper, COUNT(*) AS n FROM complexity GROUP BY paper) b USING (paper) FULL JOIN (SELECT paper, COUNT(*) AS n FROM scores GROUP BY paper) c USING (paper) ORDER BY paper",
        ]

    def statements(self):
        yield from (("field", s) for s in self.fixed())
        yield from (("literals", s) for s in self.literals())
        for family, n in [
            (self.filters, 40), (self.projections, 30), (self.groups, 40), (self.whole, 15), (self.rollups, 6), (self.joins, 60),
            (self.join_rows, 25), (self.using, 20), (self.semi, 15), (self.commas, 15), (self.three, 10), (self.windows, 40), (self.ctes, 20),
            (self.subqueries, 45), (self.sets, 20), (self.distinct, 15), (self.top, 20), (self.lists, 5),
        ]:
            for _ in range(n):
                yield family.__name__, family()


# ---- asking


def ask(program, lake, sql, form="json"):
    """Exit code, output, errors, seconds, peak of memory in MB, seconds of processors."""
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        start = time.monotonic()
        child = subprocess.Popen([program, "query", sql, "--lake", str(lake), "--format", form], stdout=out, stderr=err)
        _, status, usage = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
        seconds = time.monotonic() - start
        out.seek(0)
        err.seek(0)
        busy = usage.ru_utime + usage.ru_stime
        return child.returncode, out.read().decode(), err.read().decode(), seconds, usage.ru_maxrss / 1024, busy


def check_statements(program, lake, db, columns, verbose):
    tally, wrong, refused = Counter(), [], []
    statements = list(Grammar(db, columns).statements())
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        answers = pool.map(lambda statement: ask(program, lake, statement[1]), statements)
        asked = list(zip(statements, answers))
    for (family, sql), (code, out, err, *_) in asked:
        try:
            theirs = [list(map(plain, row)) for row in db.execute(sql).fetchall()]
        except duckdb.Error as error:
            theirs = error
        if code not in (0, 2):
            wrong.append((family, sql, f"exit code {code}: {err.strip()[-300:]}"))
            tally["wrong"] += 1
            continue
        if isinstance(theirs, duckdb.Error):
            # What DuckDB refuses has no rows to compare with.
            tally["refused by DuckDB"] += 1
            if verbose:
                print(f"DuckDB  {family}: {sql}\n        {str(theirs).splitlines()[0]}\n        ours: {out[:100]!r}")
            continue
        if code == 2:
            message = " ".join(line.strip(" │×╰─▶\u2502") for line in err.strip().splitlines())
            refused.append((family, sql, message))
            tally["refused"] += 1
            continue
        rows = [list(row.values()) for row in json.loads(out)]
        found = rows_differ(rows, theirs)
        if found:
            wrong.append((family, sql, found))
            tally["wrong"] += 1
        else:
            tally["same"] += 1
    for family, sql, message in refused:
        print(f"refused {family}: {sql}\n        {message[:200]}")
    for family, sql, message in wrong:
        print(f"WRONG   {family}: {sql}\n        {message[:400]}")
    total = sum(tally.values())
    print(f"{total} statements: " + ", ".join(f"{n} {what}" for what, n in sorted(tally.items())))
    if total < 200:
        print("expected at least 200", file=sys.stderr)
        return 2
    if tally["refused"] > REFUSED * total:
        print(f"refuses more than {REFUSED:.0%}", file=sys.stderr)
        return 1
    return 1 if wrong else 0


TIMED = {
    "scan": "SELECT COUNT(*) AS n, MIN(center) AS a, MAX(center) AS b FROM estimates WHERE ABS(center) > 1e-3 AND status = 'ok'",
    "group": "SELECT paper, estimator, AVG(upper - lower) AS w FROM estimates GROUP BY paper, estimator",
    "join": "SELECT e.estimator, COUNT(*) AS n, AVG(ABS(e.center - t.value)) AS d FROM estimates e JOIN truth t ON e.paper = t.paper "
    "AND e.experiment = t.experiment AND e.run = t.run AND e.k = t.k AND e.component = t.component WHERE e.paper = 'cz' GROUP BY e.estimator",
    "window": "SELECT COUNT(*) AS n, MAX(d) AS m FROM (SELECT value - LAG(value) OVER (PARTITION BY paper, experiment, run, component ORDER BY k) AS d FROM truth) s",
    "top-k": "SELECT paper, experiment, estimator, run, k, component, upper FROM estimates ORDER BY upper DESC, paper, experiment, estimator, run, k, component, phase LIMIT 20",
    "one paper": "SELECT COUNT(*) AS n, AVG(center) AS a FROM estimates WHERE paper = 'box'",
}


def check_times(program, lake, db):
    """Prints the times of ours and of DuckDB. A machine at work is no judge: what fails here are rows and memory."""
    threads = os.cpu_count()
    db.execute(f"SET threads = {threads}")
    print(f"{threads} threads; the best of 3 runs, ours with the start of the program; in brackets the processor's time")
    # Ours first: a child counts as its own what its parent held.
    ours = {name: [ask(program, lake, sql) for _ in range(3)] for name, sql in TIMED.items()}
    failed = False
    for name, sql in TIMED.items():
        runs = ours[name]
        wall, busy, peak = min(r[3] for r in runs), min(r[5] for r in runs), max(r[4] for r in runs)
        walls, busies = [], []
        for _ in range(3):
            start, used = time.monotonic(), time.process_time()
            rows = db.execute(sql).fetchall()
            walls.append(time.monotonic() - start)
            busies.append(time.process_time() - used)
        if runs[0][0]:
            found = f"exit code {runs[0][0]}: {runs[0][2]}"
        else:
            found = rows_differ([list(r.values()) for r in json.loads(runs[0][1])], [list(map(plain, r)) for r in rows])
        print(
            f"{name:10} {wall:6.2f} s ({busy:5.2f} s)  DuckDB {min(walls):6.2f} s ({min(busies):5.2f} s)"
            f"  ratio {wall / min(walls):5.1f} ({busy / min(busies):5.1f})  {peak:5.0f} MB  {found or 'same rows'}"
        )
        failed |= peak > 1000 or bool(found)
    return 1 if failed else 0


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program")
    parser.add_argument("lake", type=Path)
    parser.add_argument("--times", action="store_true")
    parser.add_argument("--verbose", action="store_true")
    given = parser.parse_args()
    db, columns = connect(given.lake)
    if not columns:
        print(f"{given.lake}: no tables", file=sys.stderr)
        return 2
    if given.times:
        return check_times(given.program, given.lake, db)
    return check_statements(given.program, given.lake, db, columns, given.verbose)


if __name__ == "__main__":
    sys.exit(main())
