//! Rows as a table of ratios to ours, in the terminal.

use crate::timing::HEADER;

/// The cells of a row by the names of [`HEADER`].
struct Record {
    cells: Vec<String>,
}

impl Record {
    fn text(&self, column: &str) -> &str {
        let at = HEADER
            .split(',')
            .position(|name| name == column)
            .expect("a column of the header");
        &self.cells[at]
    }

    fn number(&self, column: &str) -> f64 {
        self.text(column).parse().unwrap_or(f64::NAN)
    }

    /// What is asked, and of what size.
    fn question(&self) -> String {
        let size = ["n", "generators", "constraints"].map(|column| self.text(column));
        format!("{} ({})", self.text("operation"), size.join(", "))
    }
}

fn read(file: &str) -> Result<Vec<Record>, String> {
    let text = std::fs::read_to_string(file).map_err(|e| format!("{file}: {e}"))?;
    let columns = HEADER.split(',').count();
    let mut records = Vec::new();
    for (i, line) in text.lines().enumerate() {
        if line == HEADER {
            continue;
        }
        let cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        if cells.len() != columns {
            return Err(format!(
                "{file}:{}: expected {columns} cells, got {}",
                i + 1,
                cells.len()
            ));
        }
        records.push(Record { cells });
    }
    Ok(records)
}

/// Three digits.
fn three(x: f64) -> String {
    match x.abs() {
        a if !a.is_finite() => "-".to_owned(),
        a if a >= 100.0 => format!("{x:.0}"),
        a if a >= 10.0 => format!("{x:.1}"),
        a if a >= 1.0 => format!("{x:.2}"),
        _ => format!("{x:.3}"),
    }
}

/// Prints the rows of `files`, question by question in the order in which they first come.
pub fn print(files: &[&str]) -> Result<(), String> {
    let mut all = Vec::new();
    for file in files {
        all.extend(read(file)?);
    }
    let mut questions: Vec<String> = Vec::new();
    for record in &all {
        if !questions.contains(&record.question()) {
            questions.push(record.question());
        }
    }
    println!(
        "Times in µs; ratio = median / ours, in brackets from the 10 % to the 90 % samples of both. \
         cut: hulls that leave out a point that is in the set exactly, and the greatest part of the width left out."
    );
    for question in questions {
        println!("\n{question}");
        let rows: Vec<&Record> = all.iter().filter(|r| r.question() == question).collect();
        let ours = rows.iter().find(|r| r.text("tool") == "zonobench");
        for row in &rows {
            let ratio = ours.map_or_else(String::new, |ours| {
                let of = |a: &str, b: &str| three(row.number(a) / ours.number(b));
                format!(
                    "{} [{}, {}]",
                    of("median_us", "median_us"),
                    of("low_us", "high_us"),
                    of("high_us", "low_us")
                )
            });
            let cut = match row.text("hulls") {
                "" => String::new(),
                hulls => format!(
                    "cut {} of {hulls}, {}",
                    row.text("cut_off"),
                    row.text("worst_cut")
                ),
            };
            println!(
                "  {:<16} {:>9} (min {:>9}) {:>22}  {:<24} {}",
                row.text("tool"),
                three(row.number("median_us")),
                three(row.number("min_us")),
                ratio,
                cut,
                row.text("remark")
            );
        }
    }
    Ok(())
}
