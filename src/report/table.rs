//! Tables for people, as Markdown here and as HTML on pages.

use std::fmt;

/// A table: title, head, rows and what has to be said below it.
pub struct Table {
    /// Title.
    pub title: String,
    /// Names of the columns.
    pub head: Vec<String>,
    /// Cells by row.
    pub rows: Vec<Vec<String>>,
    /// Notes on reading it, a line each.
    pub notes: Vec<String>,
}

impl Table {
    /// The same without columns that say nothing in any row.
    pub(super) fn without_empty_columns(mut self) -> Self {
        let says = |column: usize| self.rows.iter().any(|row| row[column] != DASH);
        let kept: Vec<bool> = (0..self.head.len()).map(says).collect();
        let keep = |cells: &mut Vec<String>| {
            let mut kept = kept.iter();
            cells.retain(|_| kept.next() == Some(&true));
        };
        keep(&mut self.head);
        self.rows.iter_mut().for_each(keep);
        self
    }
}

/// Placeholder of a missing figure.
const DASH: &str = "–";

/// A figure with so many digits behind the point, or a dash.
pub(super) fn figure(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(|| DASH.to_owned(), |value| format!("{value:.digits$}"))
}

impl fmt::Display for Table {
    /// As Markdown with aligned columns.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let width = |column: usize| {
            let cells = self.rows.iter().map(|row| &row[column]);
            let all = cells.chain([&self.head[column]]);
            all.map(|cell| cell.chars().count()).max().unwrap_or(0)
        };
        let widths: Vec<usize> = (0..self.head.len()).map(width).collect();
        writeln!(f, "{}:\n", self.title)?;
        let line = |f: &mut fmt::Formatter<'_>, cells: &[String]| {
            for (column, (cell, width)) in cells.iter().zip(&widths).enumerate() {
                match column {
                    0 => write!(f, "| {cell:<width$} |")?,
                    _ => write!(f, " {cell:>width$} |")?,
                }
            }
            writeln!(f)
        };
        line(f, &self.head)?;
        for (column, width) in widths.iter().enumerate() {
            match column {
                0 => write!(f, "|{:-<1$}|", "", width + 2)?,
                _ => write!(f, "{:-<1$}:|", "", width + 1)?,
            }
        }
        writeln!(f)?;
        for row in &self.rows {
            line(f, row)?;
        }
        write!(f, "\n{}", self.notes.join("\n"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(rows: &[[&str; 3]]) -> Table {
        let owned = |cells: &[&str]| cells.iter().map(|&cell| cell.to_owned()).collect();
        Table {
            title: "Two".to_owned(),
            head: owned(&["a", "ΔE00", "LPIPS"]),
            rows: rows.iter().map(|row| owned(row)).collect(),
            notes: vec!["one".to_owned(), "two".to_owned()],
        }
    }

    #[test]
    fn tables_are_aligned_markdown() {
        let want = "Two:\n\n| a    | ΔE00 | LPIPS |\n|------|-----:|------:|\n| long |  1.5 |   0.2 |\n\none\ntwo";
        assert_eq!(table(&[["long", "1.5", "0.2"]]).to_string(), want);
    }

    #[test]
    fn columns_without_a_figure_are_left_out() {
        let some = table(&[["x", "1.5", DASH], ["y", DASH, DASH]]).without_empty_columns();
        assert_eq!(some.head, ["a", "ΔE00"]);
        assert_eq!(some.rows, [["x", "1.5"], ["y", DASH]]);
    }
}
