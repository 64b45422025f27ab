//! What is shown of a render while it goes: a progress bar, the error against a reference, and the picture itself, on a page and in
//! the tev viewer.

mod http;
pub mod live;
pub mod tev;
pub(super) mod viewers;

use super::render::RenderArgs;
use crate::image::ImageError;
use crate::image::metrics::{self, Comparison};
use crate::image::picture::Picture;
use crate::render::driver::{self, Control, Outcome, Progress};
use crate::render::photon::error::{Errors, Summary};
use crate::render::settings::Settings;
use crate::scene::Scene;
use anyhow::Context;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::Write;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use viewers::Viewers;

/// Renders with a progress bar, viewers, Ctrl-C, and the error against a reference.
pub(super) fn render(
    args: &RenderArgs,
    scene: &Scene,
    settings: &Settings,
    reference: Option<&Picture>,
    viewers: &mut Viewers,
) -> anyhow::Result<Outcome> {
    let interrupted = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&interrupted);
    ctrlc::set_handler(move || {
        if flag.swap(true, Ordering::SeqCst) {
            std::process::exit(130);
        }
    })
    .context("cannot watch for Ctrl-C")?;
    let bar = ProgressBar::no_length();
    let mut trouble = None;
    if reference.is_some() {
        writeln!(std::io::stdout(), "pass,render_s,mse,rmse,relmse")?;
    }
    let first = args.pass_range.as_ref().map_or(0, |range| range.start);
    let outcome = driver::render_from(first, scene, settings, &mut |progress| {
        let error = progress.errors.and_then(Errors::summary);
        show(&bar, progress, settings, error);
        viewers.show(progress, error);
        let reached = reference.is_some_and(|reference| {
            compared(args, progress, reference).unwrap_or_else(|error| {
                trouble = Some(error);
                true
            })
        });
        if reached || interrupted.load(Ordering::SeqCst) {
            Control::Stop
        } else {
            Control::Continue
        }
    })?;
    bar.finish_and_clear();
    if let Some(error) = trouble {
        return Err(error.into());
    }
    if interrupted.load(Ordering::SeqCst) {
        eprintln!(
            "photolathe: interrupted after pass {}; the picture so far is written",
            outcome.passes
        );
    }
    Ok(outcome)
}

/// Prints the error against the reference; whether that is small enough, or no one listens.
fn compared(
    args: &RenderArgs,
    progress: &Progress,
    reference: &Picture,
) -> Result<bool, ImageError> {
    let Comparison {
        mse, rmse, relmse, ..
    } = metrics::compare(&Picture::of_film(progress.film), reference)?;
    let row = writeln!(
        std::io::stdout(),
        "{},{:?},{mse:?},{rmse:?},{relmse:?}",
        progress.done,
        progress.seconds
    );
    Ok(row.is_err() || args.target_error.is_some_and(|target| relmse <= target))
}

/// A host and a port, as TCP takes them.
fn host_and_port(text: &str) -> Result<String, String> {
    let parts = text.rsplit_once(':');
    match parts.map(|(host, port)| (host, port.parse::<u16>())) {
        Some((host, Ok(_))) if !host.is_empty() => Ok(text.to_owned()),
        _ => Err("expected an address and a port from 0 to 65535, as in 127.0.0.1:8080".to_owned()),
    }
}

/// Rays of all kinds per second so far.
fn rays_per_second(progress: &Progress) -> f64 {
    let work = &progress.work;
    let rays = work.camera_rays + work.scattered_rays + work.shadow_rays + work.photon_segments;
    rays as f64 / progress.seconds
}

/// Shows passes, rate and time left on stderr; silent where stderr is not a terminal.
fn show(bar: &ProgressBar, progress: &Progress, settings: &Settings, error: Option<Summary>) {
    if bar.length().is_none() && progress.planned != u64::MAX {
        bar.set_length(progress.planned);
        bar.set_style(style("{bar:32} pass {pos}/{len}, {msg}, {eta} left"));
    } else if bar.position() == 0 {
        bar.set_style(style("{spinner} pass {pos}, {msg}, {elapsed}"));
    }
    let left = settings.time.map_or(String::new(), |limit| {
        format!(
            ", {:.0} s of time left",
            (limit - progress.seconds).max(0.0)
        )
    });
    let error = error.map_or(String::new(), |summary| {
        format!(", error {:.2} %", 100.0 * summary.total())
    });
    bar.set_message(format!(
        "{:.2} M rays/s{error}{left}",
        rays_per_second(progress) / 1e6
    ));
    bar.set_position(progress.done);
}

fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar())
}
