//! The page of `golden check`: new, golden and difference of every golden, what is wrong on top.

use super::{GoldenVerdict, LEVEL, Outcome, is_independent};
use crate::lab::contrast::{Contrast, ContrastView};
use crate::lab::page::{fill, number};
use crate::lab::report::duration;
use serde::Serialize;
use std::path::PathBuf;

/// What to say about a golden that cannot be accepted.
pub const INDEPENDENT: &str = "independent truth, which cannot be accepted: either the program is wrong, or the golden is, \
                               and then its source must be made anew";

/// A golden that was checked, and where it lies.
#[derive(Debug)]
pub struct Checked {
    /// Directory of the golden.
    pub directory: PathBuf,
    /// What was found.
    pub outcome: Outcome,
}

impl Checked {
    /// Order of the page: broken, different, equivalent, identical.
    pub fn urgency(&self) -> u8 {
        match self.outcome.check.as_ref().map(|check| check.verdict) {
            Err(_) => 0,
            Ok(GoldenVerdict::Different) => 1,
            Ok(GoldenVerdict::Equivalent) => 2,
            Ok(GoldenVerdict::Identical) => 3,
        }
    }

    /// The command that accepts the new picture; `None` for independent truth.
    pub fn accept_command(&self) -> Option<String> {
        let kinds = self.directory.parent()?.display().to_string();
        let at = match kinds.as_str() {
            "golden" => String::new(),
            other => format!(" --dir {other}"),
        };
        (!is_independent(&self.directory)).then(|| {
            format!(
                "photolathe golden accept {}{at} --reason \"...\"",
                self.outcome.name
            )
        })
    }
}

#[derive(Serialize)]
struct View {
    summary: String,
    level: String,
    goldens: Vec<GoldenView>,
}

#[derive(Serialize)]
struct GoldenView {
    name: String,
    directory: String,
    component: String,
    scene: String,
    reason: String,
    class: &'static str,
    verdict: &'static str,
    error: Option<String>,
    pictures: Option<ContrastView>,
    statistics: Vec<(&'static str, String, bool)>,
    accept: Option<String>,
    independent: Option<&'static str>,
    time: String,
}

/// The page of these goldens, in their order.
pub fn html(goldens: &[Checked]) -> anyhow::Result<String> {
    let count = |urgency| goldens.iter().filter(|g| g.urgency() == urgency).count();
    let summary = format!(
        "{} goldens: {} broken, {} different, {} equivalent, {} identical.",
        goldens.len(),
        count(0),
        count(1),
        count(2),
        count(3)
    );
    let views: anyhow::Result<Vec<GoldenView>> = goldens.iter().map(GoldenView::of).collect();
    let view = View {
        summary,
        level: number(LEVEL),
        goldens: views?,
    };
    Ok(fill(include_str!("../templates/golden.html"), view)?)
}

impl GoldenView {
    fn of(checked: &Checked) -> anyhow::Result<Self> {
        let outcome = &checked.outcome;
        let pictures = outcome.picture.as_ref().zip(outcome.stored.as_ref());
        let pictures = pictures.map(|(new, golden)| Contrast {
            caption: String::new(),
            a: ("new".to_owned(), new.clone()),
            b: ("golden".to_owned(), golden.clone()),
            commands: Vec::new(),
        });
        let (class, verdict) = match checked.urgency() {
            0 => ("fail", "broken"),
            1 => ("fail", GoldenVerdict::Different.word()),
            2 => ("pass", GoldenVerdict::Equivalent.word()),
            _ => ("pass", GoldenVerdict::Identical.word()),
        };
        let golden = outcome.golden.as_ref();
        let different = checked.urgency() == 1;
        Ok(Self {
            name: outcome.name.clone(),
            directory: checked.directory.display().to_string(),
            component: outcome.component.clone(),
            scene: golden.map_or_else(String::new, |golden| {
                format!("{} {}", golden.scene.display(), golden.set.join(" "))
            }),
            reason: golden
                .and_then(|golden| golden.reason.clone())
                .unwrap_or_default(),
            class,
            verdict,
            error: outcome
                .check
                .as_ref()
                .err()
                .map(|error| format!("{error:#}")),
            // Of different sizes there is nothing to see but the error.
            pictures: pictures.and_then(|pair| pair.view().ok()),
            statistics: statistics(outcome),
            accept: checked.accept_command().filter(|_| different),
            independent: (different && is_independent(&checked.directory)).then_some(INDEPENDENT),
            time: duration(outcome.seconds),
        })
    }
}

/// Name, value, and whether it is a reason for the verdict "different".
fn statistics(outcome: &Outcome) -> Vec<(&'static str, String, bool)> {
    let Ok(check) = &outcome.check else {
        return Vec::new();
    };
    let mut rows = vec![("largest difference of a value", number(check.max), false)];
    if check.verdict == GoldenVerdict::Identical {
        return rows;
    }
    if check.replicates == 0 {
        rows.push((
            "bits differ, and nothing in the picture is random",
            String::new(),
            true,
        ));
        return rows;
    }
    rows.push(("replicates", check.replicates.to_string(), false));
    // Two families share the level: each is held to half of it.
    let failing = |p: f64| p < 0.5 * LEVEL;
    rows.push((
        "p of the mean of the picture",
        number(check.p_mean),
        failing(check.p_mean),
    ));
    rows.push((
        "p of the 8 × 8-pixel blocks",
        number(check.p_blocks),
        failing(check.p_blocks),
    ));
    rows.push(("p of both together", number(check.p), check.p < LEVEL));
    let percent = |share: f64| format!("{} %", number(100.0 * share));
    rows.push((
        "change of the mean that would have been seen",
        percent(check.detectable),
        false,
    ));
    rows.push((
        "change of any block that would have been seen, as a share of the mean",
        percent(check.detectable_block),
        false,
    ));
    rows
}

#[cfg(test)]
mod tests {
    use super::super::Check;
    use super::*;
    use crate::image::picture::Picture;

    fn checked(kind: &str, name: &str, verdict: GoldenVerdict) -> Checked {
        let picture = Picture {
            width: 2,
            height: 1,
            rgb: vec![[0.5; 3]; 2],
            ..Picture::default()
        };
        let check = Check {
            verdict,
            replicates: 32,
            p: 1e-9,
            p_mean: 5e-10,
            p_blocks: 0.3,
            detectable: 0.01,
            detectable_block: 0.1,
            max: 0.25,
        };
        Checked {
            directory: PathBuf::from("golden").join(kind),
            outcome: Outcome {
                name: name.to_owned(),
                component: "camera".to_owned(),
                check: Ok(check),
                golden: None,
                picture: Some(picture.clone()),
                stored: Some(picture),
                seconds: 0.1,
            },
        }
    }

    #[test]
    fn what_is_different_shows_its_failing_statistic_and_how_to_accept_it() {
        let page = html(&[checked("regression", "lens", GoldenVerdict::Different)]).unwrap();
        assert!(page.contains("1 different"));
        assert!(page.contains("photolathe golden accept lens --reason &quot;...&quot;"));
        assert_eq!(page.matches("class=\"fail\">p of").count(), 2, "{page}");
        assert_eq!(page.matches("src=\"data:image/png").count(), 3);
        assert!(page.contains("<script>") && page.contains("nothing differs"));
        assert!(!page.contains("http"), "the page needs a network");
    }

    #[test]
    fn independent_truth_and_what_is_right_have_no_command_to_accept_them() {
        for golden in [
            checked("reference", "box", GoldenVerdict::Different),
            checked("regression", "lens", GoldenVerdict::Equivalent),
            checked("regression", "lens", GoldenVerdict::Identical),
        ] {
            let independent = golden.urgency() == 1;
            let page = html(&[golden]).unwrap();
            assert!(!page.contains("golden accept"));
            assert_eq!(page.contains("cannot be accepted"), independent);
        }
    }

    #[test]
    fn what_is_broken_says_why() {
        let mut broken = checked("regression", "lens", GoldenVerdict::Identical);
        broken.outcome.check = Err(anyhow::anyhow!("no such <scene>"));
        broken.outcome.picture = None;
        assert_eq!(broken.urgency(), 0);
        let page = html(&[broken]).unwrap();
        assert!(page.contains("no such &lt;scene&gt;"));
    }
}
