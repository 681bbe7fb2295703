//! The entries of a matrix that are not 0, by rows and by columns.

use crate::List;

/// Rows, or columns, each a run of positions and values.
#[derive(Clone, Debug, Default)]
pub(super) struct Lines {
    start: List<usize>,
    index: List<u32>,
    value: List<f64>,
}

impl Lines {
    /// Number of lines.
    pub(super) fn len(&self) -> usize {
        self.start.len() - 1
    }

    /// Number of entries.
    pub(super) fn entries(&self) -> usize {
        self.index.len()
    }

    /// Positions, ascending, and values of line `i`.
    #[inline]
    pub(super) fn line(&self, i: usize) -> impl Iterator<Item = (usize, f64)> + Clone {
        let (from, to) = (self.start[i], self.start[i + 1]);
        let index = self.index[from..to].iter().map(|&j| j as usize);
        index.zip(self.value[from..to].iter().copied())
    }

    /// Number of entries of line `i`.
    #[inline]
    pub(super) fn count(&self, i: usize) -> usize {
        self.start[i + 1] - self.start[i]
    }

    fn clear(&mut self) {
        self.start.clear();
        self.start.push(0);
        self.index.clear();
        self.value.clear();
    }

    /// The entries of the next line, ascending in their positions.
    fn append(&mut self, line: impl Iterator<Item = (usize, f64)>) {
        for (j, x) in line {
            self.index.push(j as u32);
            self.value.push(x);
        }
        self.start.push(self.index.len());
    }
}

/// A matrix by its rows and by its columns.
#[derive(Clone, Debug, Default)]
pub(super) struct Compressed {
    pub(super) rows: Lines,
    pub(super) cols: Lines,
}

impl Compressed {
    /// Takes `rows` lines, each ascending in its positions below `cols`.
    pub(super) fn fill<L>(&mut self, rows: usize, cols: usize, mut row: impl FnMut(usize) -> L)
    where
        L: Iterator<Item = (usize, f64)>,
    {
        self.rows.clear();
        for i in 0..rows {
            self.rows.append(row(i));
        }
        let own = &mut self.cols;
        own.start.clear();
        own.start.resize(cols + 1, 0);
        for &j in self.rows.index.iter() {
            own.start[j as usize + 1] += 1;
        }
        for j in 0..cols {
            own.start[j + 1] += own.start[j];
        }
        own.index.clear();
        own.index.resize(self.rows.entries(), 0);
        own.value.clear();
        own.value.resize(self.rows.entries(), 0.0);
        let mut next: List<usize> = own.start.iter().copied().collect();
        for i in 0..rows {
            for (j, x) in self.rows.line(i) {
                own.index[next[j]] = i as u32;
                own.value[next[j]] = x;
                next[j] += 1;
            }
        }
    }
}
