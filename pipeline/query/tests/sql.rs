//! SQL over small tables: what it gives, what it refuses, and which files it reads.

use arrow_array::builder::{Float64Builder, ListBuilder};
use arrow_array::{ArrayRef, Float64Array, Int32Array, RecordBatch, StringArray};
use parquet::arrow::ArrowWriter;
use parquet::file::properties::WriterProperties;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use zonobench_query::sql::{Fault, File, Format, Table, print, run};

/// A lake of two tables: `points` by paper and experiment, `names` by paper.
struct Lake {
    root: PathBuf,
    _folder: tempfile::TempDir,
    tables: Vec<Table>,
}

fn write(path: &Path, columns: Vec<(&str, ArrayRef)>, group: usize) {
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    let batch = RecordBatch::try_from_iter_with_nullable(
        columns.into_iter().map(|(name, array)| (name, array, true)),
    )
    .unwrap();
    let properties = WriterProperties::builder()
        .set_max_row_group_row_count(Some(group))
        .build();
    let file = std::fs::File::create(path).unwrap();
    let mut writer = ArrowWriter::try_new(file, batch.schema(), Some(properties)).unwrap();
    writer.write(&batch).unwrap();
    writer.close().unwrap();
}

impl Lake {
    fn new() -> Self {
        Self::below("lake".as_ref())
    }

    fn below(name: &std::ffi::OsStr) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path().join(name);
        let mut lake = Self {
            root,
            _folder: folder,
            tables: Vec::new(),
        };
        for (paper, experiment, from) in [("a", "one", 0), ("a", "two", 10), ("b", "one", 20)] {
            let run = Int32Array::from_iter_values((0..4).map(|i| i / 2));
            let k = Int32Array::from_iter_values((0..4).map(|i| from + i % 2));
            let x = Float64Array::from(vec![Some(0.5), None, Some(-0.0), Some(f64::from(from))]);
            let name = StringArray::from(vec!["p", "q", "p", "r"]);
            let mut list = ListBuilder::new(Float64Builder::new());
            for i in 0..4 {
                list.append_value([Some(f64::from(i)), Some(2.0)]);
            }
            let columns: Vec<(&str, ArrayRef)> = vec![
                ("run", Arc::new(run)),
                ("k", Arc::new(k)),
                ("x", Arc::new(x)),
                ("name", Arc::new(name)),
                ("list", Arc::new(list.finish())),
            ];
            lake.add(
                "points",
                &[("paper", paper), ("experiment", experiment)],
                columns,
                2,
            );
        }
        for paper in ["a", "b"] {
            let name = StringArray::from(vec![Some("p"), Some("r"), None]);
            let n = Int32Array::from(vec![1, 2, 3]);
            let columns: Vec<(&str, ArrayRef)> = vec![("name", Arc::new(name)), ("n", Arc::new(n))];
            lake.add("names", &[("paper", paper)], columns, 100);
        }
        lake
    }

    fn add(
        &mut self,
        table: &str,
        keys: &[(&str, &str)],
        columns: Vec<(&str, ArrayRef)>,
        group: usize,
    ) {
        let mut path = self.root.join(table);
        path.extend(keys.iter().map(|(key, value)| format!("{key}={value}")));
        path.push("part-0.parquet");
        write(&path, columns, group);
        let file = File {
            path,
            keys: keys.iter().map(|(_, value)| (*value).to_owned()).collect(),
        };
        match self.tables.iter_mut().find(|t| t.name == table) {
            Some(table) => table.files.push(file),
            None => self.tables.push(Table {
                name: table.to_owned(),
                keys: keys.iter().map(|(key, _)| (*key).to_owned()).collect(),
                files: vec![file],
            }),
        }
    }

    fn text(&self, statement: &str, format: Format) -> Result<String, Fault> {
        let mut out = Vec::new();
        print(self.tables.clone(), statement, format, &mut out)?;
        Ok(String::from_utf8(out).unwrap())
    }

    /// The rows as CSV, without the header.
    fn rows(&self, statement: &str) -> String {
        let text = self
            .text(statement, Format::Csv)
            .unwrap_or_else(|fault| panic!("{statement}: {fault}"));
        text.split_once('\n').unwrap().1.to_owned()
    }

    fn fault(&self, statement: &str) -> String {
        match self.text(statement, Format::Csv) {
            Ok(text) => panic!("{statement} gives {text}"),
            Err(fault) => fault.to_string(),
        }
    }
}

#[test]
fn a_constant_in_a_join_is_of_the_table_that_it_names() {
    let lake = Lake::new();
    let joined = "FROM points p JOIN points q ON p.paper = q.paper AND p.experiment = q.experiment AND p.k = q.k";
    assert_eq!(
        lake.rows(&format!(
            "SELECT COUNT(*), SUM(p.run), SUM(q.run) {joined} AND q.run = 0"
        )),
        "12,6,0\n"
    );
    assert_eq!(
        lake.rows(&format!(
            "SELECT COUNT(*), SUM(p.run), SUM(q.run) {joined} AND p.run = 0"
        )),
        "12,0,6\n"
    );
}

#[test]
fn joins_of_every_kind_keep_the_rows_that_they_should() {
    let lake = Lake::new();
    let joined = |kind: &str, on: &str| {
        lake.rows(&format!(
            "SELECT COUNT(*) AS n FROM names l {kind} JOIN names r ON {on}"
        ))
    };
    let on = "l.paper = r.paper AND l.n < r.n";
    assert_eq!(joined("INNER", on), "6\n");
    assert_eq!(joined("LEFT", on), "8\n");
    assert_eq!(joined("RIGHT", on), "8\n");
    assert_eq!(joined("FULL", on), "10\n");
    assert_eq!(joined("LEFT SEMI", on), "4\n");
    assert_eq!(joined("LEFT ANTI", on), "2\n");
    assert_eq!(
        joined("LEFT", "l.n BETWEEN r.n - 1 AND r.n OR l.name = r.name"),
        "20\n"
    );
    assert_eq!(joined("LEFT", "FALSE"), "6\n");
    assert_eq!(joined("FULL", "l.name = r.name"), "12\n");
    assert_eq!(
        lake.rows(
            "SELECT COUNT(*) FROM points p, names n WHERE p.paper = n.paper AND p.name = n.name"
        ),
        "9\n"
    );
}

#[test]
fn a_column_of_using_is_one_of_both_sides() {
    let lake = Lake::new();
    let tables = "WITH a AS (SELECT * FROM (VALUES (1, 'x'), (2, 'y')) t(k, p)), \
                  b AS (SELECT * FROM (VALUES (2, 'u'), (3, 'v')) t(k, q)) SELECT";
    for (rest, rows) in [
        ("k FROM b RIGHT JOIN a USING (k) ORDER BY k", "1\n2\n"),
        (
            "k, p, q FROM a FULL JOIN b USING (k) ORDER BY k",
            "1,x,\n2,y,u\n3,,v\n",
        ),
        (
            "k, COUNT(*) FROM a FULL JOIN b USING (k) WHERE k > 1 GROUP BY k ORDER BY 1",
            "2,1\n3,1\n",
        ),
        (
            "a.k, b.k FROM a FULL JOIN b USING (k) ORDER BY COALESCE(a.k, b.k)",
            "1,\n2,2\n,3\n",
        ),
        ("* FROM b LEFT JOIN a USING (k) ORDER BY k", "2,u,y\n3,v,\n"),
        ("COUNT(*) FROM a SEMI JOIN b USING (k)", "1\n"),
        ("k FROM a NATURAL JOIN b", "2\n"),
    ] {
        assert_eq!(lake.rows(&format!("{tables} {rest}")), rows, "{rest}");
    }
    for rest in [
        "* FROM a FULL JOIN b USING (k)",
        "k FROM a NATURAL FULL JOIN b",
        "* FROM a NATURAL JOIN b",
    ] {
        let fault = lake.fault(&format!("{tables} {rest}"));
        assert!(fault.contains("is refused: write ON"), "{rest}: {fault}");
    }
}

#[test]
fn is_distinct_from_ends_where_the_condition_does() {
    let lake = Lake::new();
    let counted =
        |condition: &str| lake.rows(&format!("SELECT COUNT(*) FROM names WHERE {condition}"));
    assert_eq!(counted("name IS DISTINCT FROM 'p' AND n = 2"), "2\n");
    assert_eq!(
        counted("n = 1 AND name IS NOT DISTINCT FROM 'p' OR n = 3"),
        "4\n"
    );
    assert_eq!(counted("(n = 2) IS DISTINCT FROM TRUE AND n > 1"), "2\n");
}

#[test]
fn subqueries_stand_wherever_sql_has_them() {
    let lake = Lake::new();
    for (statement, rows) in [
        (
            "SELECT COUNT(*) FROM points p WHERE EXISTS (SELECT 1 FROM names n WHERE n.name = p.name AND n.n = 2)",
            "3\n",
        ),
        (
            "SELECT COUNT(*) FROM points WHERE k > (SELECT AVG(k) FROM points)",
            "6\n",
        ),
        (
            "SELECT COUNT(*) FROM points WHERE name IN (SELECT name FROM names)",
            "9\n",
        ),
        // One of them is missing: of no name is it known that it is none of them.
        (
            "SELECT COUNT(*) FROM points WHERE name NOT IN (SELECT name FROM names)",
            "0\n",
        ),
        (
            "SELECT name, (SELECT MAX(n) FROM names n WHERE n.name = p.name) AS m FROM points p WHERE k = 0 ORDER BY run",
            "p,1\np,1\n",
        ),
        (
            "WITH a AS (SELECT name, COUNT(*) AS n FROM points GROUP BY name) SELECT name FROM a WHERE n = (SELECT MAX(n) FROM a)",
            "p\n",
        ),
    ] {
        assert_eq!(lake.rows(statement), rows, "{statement}");
    }
}

#[test]
fn numbers_are_read_and_printed_in_every_form() {
    let lake = Lake::new();
    assert_eq!(
        lake.text(
            "SELECT 1.0e-300 AS a, 1.7e308 AS b, 1e6 AS c, .5 AS d, 1e-3 AS e",
            Format::Csv
        )
        .unwrap(),
        "a,b,c,d,e\n1e-300,1.7e308,1000000,0.5,0.001\n"
    );
    let table = lake
        .text("SELECT 1.0e-300 AS a, 1.7e308 AS b", Format::Table)
        .unwrap();
    assert!(
        table.contains("1e-300") && table.contains("1.7e308"),
        "{table}"
    );
    assert_eq!(
        lake.text(
            "SELECT 1e-300 AS a, NULL AS b, 'x' AS c, list FROM points WHERE k = 1 AND run = 0",
            Format::Json
        )
        .unwrap(),
        "[\n  {\n    \"a\": 1e-300,\n    \"b\": null,\n    \"c\": \"x\",\n    \"list\": [\n      1.0,\n      2.0\n    ]\n  }\n]\n"
    );
    assert_eq!(
        lake.text("SELECT k FROM points WHERE k < 0", Format::Json)
            .unwrap(),
        "[]\n"
    );
    assert_eq!(
        lake.text("SELECT k FROM points WHERE k < 0", Format::Csv)
            .unwrap(),
        "k\n"
    );
    assert!(
        lake.text("SELECT k FROM points WHERE k < 0", Format::Table)
            .unwrap()
            .ends_with("0 rows\n")
    );
    assert_eq!(
        lake.rows("SELECT list[1], list FROM points WHERE run = 1 AND k = 1"),
        "3,\"[3, 2]\"\n"
    );
}

#[test]
fn arithmetic_is_duckdb_s() {
    let lake = Lake::new();
    for (expression, value) in [
        ("7 / 2", "3.5"),
        ("-7 // 2", "-3"),
        ("-7 % 3", "-1"),
        ("1 / 0", "inf"),
        ("CAST(2.5 AS INTEGER)", "3"),
        ("CAST(2.5e0 AS INTEGER)", "2"),
        ("CAST(CAST(2.7 AS DOUBLE) AS BIGINT)", "3"),
        ("0.0 = -0.0", "true"),
        ("-x = 0 FROM points WHERE run = 1 AND k = 0", "true"),
        ("COUNT(*) FROM points WHERE x = 0", "4"),
        ("COUNT(DISTINCT x) FROM points", "4"),
        ("SIGN(-2.5)", "-1"),
        ("SUM(k) / COUNT(*) FROM points WHERE k < 20", "5.5"),
        ("SUM(DISTINCT run) FROM points", "1"),
        (
            "MEDIAN(k) FROM points WHERE experiment = 'one' AND paper = 'a'",
            "0.5",
        ),
        ("k FROM points ORDER BY x, k LIMIT 1 OFFSET 11", "21"),
    ] {
        assert_eq!(
            lake.rows(&format!("SELECT {expression}")),
            format!("{value}\n"),
            "{expression}"
        );
    }
    for expression in [
        "9223372036854775807 + 1",
        "k * 9223372036854775807 FROM points WHERE k > 1",
        "1 // 0",
    ] {
        let fault = lake.fault(&format!("SELECT {expression}"));
        assert!(
            fault.contains("verflow") || fault.contains("by zero"),
            "{fault}"
        );
    }
}

#[test]
fn a_value_in_a_path_is_text_whatever_it_looks_like() {
    let mut lake = Lake::new();
    let values = ["inf", "true", "epoch", "007", "1e5", "null", "2020-01-01"];
    for value in values {
        let columns: Vec<(&str, ArrayRef)> = vec![("v", Arc::new(Int32Array::from(vec![1])))];
        lake.add(
            "odd",
            &[("paper", value), ("experiment", "e")],
            columns,
            100,
        );
    }
    let mut sorted = values;
    sorted.sort_unstable();
    assert_eq!(
        lake.rows("SELECT paper FROM odd ORDER BY paper"),
        sorted.map(|v| format!("{v}\n")).concat()
    );
    for value in values {
        assert_eq!(
            lake.rows(&format!("SELECT COUNT(*) FROM odd WHERE paper = '{value}'")),
            "1\n"
        );
    }
}

#[test]
fn files_whose_path_cannot_meet_the_condition_are_not_read() {
    let lake = Lake::new();
    let spoilt = lake
        .root
        .join("points/paper=b/experiment=one/part-0.parquet");
    std::fs::write(&spoilt, "no Parquet").unwrap();
    for condition in [
        "paper = 'a'",
        "paper IN ('a', 'c')",
        "UPPER(paper) = 'A'",
        "paper || experiment LIKE 'a%'",
        "paper < 'b' AND k >= 0",
        "NOT paper = 'b'",
    ] {
        assert_eq!(
            lake.rows(&format!("SELECT COUNT(*) FROM points WHERE {condition}")),
            "8\n",
            "{condition}"
        );
    }
    let names = "SELECT COUNT(k) FROM points p JOIN names n ON p.paper = n.paper WHERE n.paper = 'a' AND p.paper = 'a'";
    assert_eq!(lake.rows(names), "24\n");
    let fault = lake.fault("SELECT COUNT(*) FROM points");
    assert!(fault.contains(spoilt.to_str().unwrap()), "{fault}");
}

#[test]
fn row_groups_are_left_out_by_their_least_and_greatest_values() {
    let lake = Lake::new();
    let plan = lake.rows("EXPLAIN SELECT COUNT(k) FROM points WHERE x > 15");
    assert!(plan.contains("files=3, row_groups=1"), "{plan}");
    assert_eq!(lake.rows("SELECT COUNT(k) FROM points WHERE x > 15"), "1\n");
}

#[cfg(unix)]
#[test]
fn a_lake_may_lie_below_a_path_that_is_no_text() {
    use std::os::unix::ffi::OsStrExt;
    let lake = Lake::below(std::ffi::OsStr::from_bytes(b"l\xff\xfeke"));
    assert_eq!(
        lake.rows("SELECT COUNT(*) FROM points WHERE experiment = 'one'"),
        "8\n"
    );
}

#[test]
fn a_statement_that_would_change_something_is_refused_by_name() {
    let lake = Lake::new();
    let before = std::fs::read(&lake.tables[0].files[0].path).unwrap();
    for (statement, name) in [
        ("DELETE FROM points", "DELETE"),
        ("INSERT INTO points VALUES (1)", "INSERT"),
        ("CREATE TABLE t AS SELECT 1", "CREATE"),
        ("COPY points TO 'x.csv'", "COPY"),
        ("SET datafusion.execution.batch_size = 1", "SET"),
        ("DROP TABLE points", "DROP"),
    ] {
        let fault = lake.fault(statement);
        assert!(fault.contains(&format!("{name} is refused")), "{fault}");
    }
    assert_eq!(
        std::fs::read(&lake.tables[0].files[0].path).unwrap(),
        before
    );
    assert!(
        lake.fault("SELECT * FROM '/etc/passwd'")
            .contains("no table")
    );
    assert!(
        lake.fault("SELECT * FROM read_parquet('x')")
            .contains("read_parquet")
    );
}

#[test]
fn what_is_very_long_is_not_repeated_whole() {
    let lake = Lake::new();
    let long = "x".repeat(100_000);
    for statement in [
        long.clone(),
        format!("SELECT {long} FROM points"),
        format!("SELECT * FROM {long}"),
        format!("SELECT {long}(k) FROM points"),
    ] {
        let fault = lake.fault(&statement);
        assert!(
            fault.len() < 1000 && fault.contains("xxx..."),
            "{fault:.2000}"
        );
    }
}

#[test]
fn a_query_does_not_ask_what_time_it_is() {
    let lake = Lake::new();
    let fault = lake.fault("SELECT now()");
    assert!(fault.contains("now() is refused"), "{fault}");
}

#[test]
fn a_name_that_is_not_there_is_answered_by_the_nearest() {
    let lake = Lake::new();
    for (statement, parts) in [
        (
            "SELECT * FROM point",
            &["no table `point`", "did you mean `points`"][..],
        ),
        (
            "SELECT ru FROM points",
            &["no column `ru`", "did you mean `run`", "experiment"],
        ),
        (
            "SELECT p.naem FROM points p",
            &["no column `p.naem`", "did you mean `name`"],
        ),
        (
            "SELECT k FROM points p JOIN points q ON p.k = q.k",
            &["`k` is in more than one table"],
        ),
        ("SELECT nosuch(k) FROM points", &["nosuch"]),
        (
            "SELECT name, COUNT(*) FROM points GROUP BY paper",
            &["name"],
        ),
    ] {
        let fault = lake.fault(statement);
        assert!(
            parts.iter().all(|p| fault.contains(p)),
            "{statement}: {fault}"
        );
    }
}

#[test]
fn columns_are_called_as_they_are_written() {
    let lake = Lake::new();
    let header = |statement: &str| {
        let text = lake.text(statement, Format::Csv).unwrap();
        text.lines().next().unwrap().to_owned()
    };
    assert_eq!(
        header("SELECT k / 2, COUNT(*), COUNT(*), AVG(x) AS mean FROM points GROUP BY k / 2"),
        "k / 2,COUNT(*),COUNT(*)_1,mean"
    );
    assert_eq!(
        header("SELECT p.k, q.k FROM points p JOIN points q ON p.k = q.k"),
        "k,k_1"
    );
    assert_eq!(header("SELECT * FROM names"), "name,n,paper");
}

/// Sums of a table that is large enough to be cut into shares, whatever is added first.
#[test]
fn sums_of_floats_have_the_same_bits_every_time() {
    let mut lake = Lake::new();
    let n = 600_000;
    let x = Float64Array::from_iter_values((0..n).map(|i| 1.0 / f64::from(i + 1)));
    let group = Int32Array::from_iter_values((0..n).map(|i| i % 7));
    let columns: Vec<(&str, ArrayRef)> = vec![("x", Arc::new(x)), ("g", Arc::new(group))];
    lake.add("large", &[("paper", "a")], columns, 10_000);
    let statement = "SELECT g, SUM(x), AVG(x), COUNT(*) FROM large GROUP BY g";
    let first = lake.rows(statement);
    assert_eq!(first.lines().count(), 7);
    for _ in 0..5 {
        assert_eq!(lake.rows(statement), first);
    }
    assert!(
        lake.rows(&format!("EXPLAIN {statement}"))
            .contains("InOrderExec")
    );
    // And they are the sums.
    let answer = run(
        lake.tables.clone(),
        "SELECT SUM(x) AS s, COUNT(*) AS n FROM large",
    )
    .unwrap();
    let sum: f64 = (0..n).map(|i| 1.0 / f64::from(i + 1)).sum();
    let found = answer.value("s", 0).and_then(|v| v.number()).unwrap();
    assert!((found - sum).abs() < 1e-12 * sum, "{found} {sum}");
    assert_eq!(
        answer.value("n", 0).and_then(|v| v.number()),
        Some(f64::from(n))
    );
    let union = "SELECT SUM(x) FROM (SELECT x FROM large WHERE g = 1 UNION ALL SELECT x * 3 FROM large WHERE g <> 1) u";
    let first = lake.rows(union);
    for _ in 0..5 {
        assert_eq!(lake.rows(union), first);
    }
}

#[test]
fn rows_come_in_the_order_of_the_files() {
    let lake = Lake::new();
    assert_eq!(
        lake.rows("SELECT paper, experiment, k FROM points"),
        "a,one,0\na,one,1\na,one,0\na,one,1\na,two,10\na,two,11\na,two,10\na,two,11\nb,one,20\nb,one,21\nb,one,20\nb,one,21\n"
    );
    assert_eq!(
        lake.rows("SELECT k FROM points LIMIT 3 OFFSET 3"),
        "1\n10\n11\n"
    );
}
