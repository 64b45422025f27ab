//! Tables for the terminal.

use crate::lab::claim::Claim;
use crate::lab::page::ascii_number;
use crate::lab::report::{duration, urgency};

/// Lines up columns; the first ones to the left, numbers should come formatted.
pub(crate) fn aligned(header: &[&str], rows: &[Vec<String>]) -> String {
    let width = |column: usize| {
        let cells = rows.iter().map(|row| row[column].chars().count());
        cells.chain([header[column].len()]).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..header.len()).map(width).collect();
    let line = |cells: Vec<&str>| {
        let padded = cells
            .iter()
            .zip(&widths)
            .map(|(cell, &width)| format!("{cell:width$}"));
        padded.collect::<Vec<_>>().join("  ").trim_end().to_owned() + "\n"
    };
    let body = rows
        .iter()
        .map(|row| line(row.iter().map(String::as_str).collect()));
    std::iter::once(line(header.to_vec())).chain(body).collect()
}

/// The claims with the seconds of their experiments, failures first.
pub(crate) fn claims(claims: &[(&Claim, f64)]) -> String {
    let mut sorted = claims.to_vec();
    sorted.sort_by_key(|(claim, _)| urgency(claim.verdict));
    let rows: Vec<Vec<String>> = sorted
        .iter()
        .map(|(claim, seconds)| row(claim, *seconds))
        .collect();
    aligned(
        &[
            "verdict",
            "claim",
            "predicted",
            "measured",
            "95 % interval",
            "detectable",
            "time",
        ],
        &rows,
    )
}

fn row(claim: &Claim, seconds: f64) -> Vec<String> {
    vec![
        claim.verdict.word().to_owned(),
        format!("{}/{}", claim.experiment, claim.claim),
        ascii_number(claim.predicted),
        ascii_number(claim.measured),
        format!(
            "{} .. {}",
            ascii_number(claim.ci_low),
            ascii_number(claim.ci_high)
        ),
        ascii_number(claim.detectable),
        duration(seconds),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_line_up() {
        let rows = [
            vec!["pass".to_owned(), "a/b".to_owned()],
            vec!["inconclusive".to_owned(), "c".to_owned()],
        ];
        assert_eq!(
            aligned(&["verdict", "claim"], &rows),
            "verdict       claim\npass          a/b\ninconclusive  c\n"
        );
    }
}
