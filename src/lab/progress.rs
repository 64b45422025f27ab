//! How far the work is: a bar on a terminal, a line per part elsewhere. Always on stderr.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal as _;

/// Progress of one part of the work.
#[derive(Debug)]
pub struct Progress {
    bar: Option<ProgressBar>,
    name: String,
}

impl Progress {
    /// Starts a part.
    pub fn start(name: &str) -> Self {
        let bar = std::io::stderr().is_terminal().then(|| {
            let style = ProgressStyle::with_template(
                "{msg:20} [{bar:30}] {pos}/{len} {elapsed_precise} left {eta}",
            );
            let bar = ProgressBar::with_draw_target(Some(0), ProgressDrawTarget::stderr());
            bar.set_style(style.expect("the template is right").progress_chars("=> "));
            bar.set_message(name.to_owned());
            bar
        });
        Self {
            bar,
            name: name.to_owned(),
        }
    }

    /// Tells the number of steps done and in all.
    pub fn tell(&self, done: usize, all: usize) {
        if let Some(bar) = &self.bar {
            bar.set_length(all as u64);
            bar.set_position(done as u64);
        }
    }

    /// Ends the part with a line.
    pub fn end(self, line: &str) {
        match &self.bar {
            Some(bar) => {
                bar.finish_and_clear();
                eprintln!("{:20} {line}", self.name);
            }
            None => eprintln!("{:20} {line}", self.name),
        }
    }
}
