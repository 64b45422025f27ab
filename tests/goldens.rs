//! The goldens of the repository: what we draw is what was accepted, bit by bit, and agrees with independent truth.

use photolathe::lab::golden::{self, GoldenVerdict};
use std::path::PathBuf;

fn directory(kind: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("golden")
        .join(kind)
}

#[test]
fn every_picture_is_identical_to_its_golden() {
    let outcomes = golden::check_all(&directory("regression"));
    for component in [
        "Newton solver",
        "Bernstein solver",
        "bounding cylinder",
        "kd-tree",
        "path-hash antialiasing",
        "thin lens",
        "PPM radius shrink",
        "path tracer",
    ] {
        assert!(
            outcomes
                .iter()
                .any(|outcome| outcome.component == component),
            "{component} has no golden"
        );
    }
    for outcome in outcomes {
        let check = outcome
            .check
            .unwrap_or_else(|error| panic!("{}: {error:#}", outcome.name));
        assert_eq!(
            check.verdict,
            GoldenVerdict::Identical,
            "{}: {check:?}",
            outcome.name
        );
    }
}

#[test]
fn pictures_agree_with_independent_truth() {
    let outcomes = golden::check_all(&directory("reference"));
    assert!(!outcomes.is_empty());
    for outcome in outcomes {
        let check = outcome
            .check
            .unwrap_or_else(|error| panic!("{}: {error:#}", outcome.name));
        assert_ne!(
            check.verdict,
            GoldenVerdict::Different,
            "{}: {check:?}",
            outcome.name
        );
    }
}
