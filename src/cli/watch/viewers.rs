//! The picture in the making, handed to those who look at it: the live page and tev.
//!
//! Between passes the render rounds its film to a picture and leaves that where the viewers' own threads find it; it never waits for
//! one of them, and encodes nothing. How often depends on what it costs, so that at most about a fiftieth of the time goes there.

use super::live::{Frame, Server, State};
use super::rays_per_second;
use super::tev::Sender;
use crate::cli::render::RenderArgs;
use crate::image::picture::Picture;
use crate::render::driver::{Outcome, Progress};
use crate::render::film::{Film, Pixel};
use crate::render::photon::error::Summary;
use crate::render::settings::Settings;
use crate::scene::Scene;
use crate::scene::options::Integrator;
use rayon::prelude::*;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Least time between two pictures, and between two messages on where the render stands. Pictures wait longer where one of them costs
/// more than a fiftieth of that.
const INTERVAL: Duration = Duration::from_secs(1);
const MOST_SHARE: u32 = 50;
/// A PNG is encoded beside the render, but by the same cores: that may take a share of one of them.
const MOST_ENCODING: u32 = 20;
/// Points of the plot, at most; beyond, every other one is dropped.
const MOST_POINTS: usize = 256;

/// Those who look at the picture while it is made.
pub(in crate::cli) struct Viewers {
    live: Option<Server>,
    tev: Option<Sender>,
    state: State,
    frame: Arc<Frame>,
    /// Seconds after which the render ends.
    limit: Option<f64>,
    /// When the next message may be sent.
    next: Instant,
    /// When the next picture may be taken.
    next_picture: Instant,
}

impl Viewers {
    /// Opens what the flags ask for.
    ///
    /// # Errors
    /// If the address of the page cannot be had. That tev is absent is only said.
    pub(in crate::cli) fn open(
        args: &RenderArgs,
        scene: &Scene,
        settings: &Settings,
    ) -> anyhow::Result<Self> {
        let title = match scene.title.as_str() {
            "" => args.scene.file_stem().unwrap_or_default().to_string_lossy(),
            title => title.into(),
        };
        let state = State::new(&title, settings.integrator);
        let live = args.live.as_ref();
        let live = live.map(|address| Server::open(address, &state, args.exposure));
        Ok(Self {
            live: live.transpose()?,
            tev: args
                .tev
                .clone()
                .map(|address| Sender::open(address, &title)),
            state,
            frame: Arc::default(),
            limit: settings.time,
            next: Instant::now(),
            next_picture: Instant::now(),
        })
    }

    /// Takes note of a pass; hands a picture on if it is time for one.
    pub(super) fn show(&mut self, progress: &Progress, error: Option<Summary>) {
        if self.live.is_none() && self.tev.is_none() {
            return;
        }
        self.state.note(progress, self.limit);
        self.state.rays_per_s = rays_per_second(progress);
        let start = Instant::now();
        if start < self.next {
            return;
        }
        self.next = start + INTERVAL;
        if start >= self.next_picture {
            self.take(progress.film, error.map(|summary| summary.total()));
            let cost = start.elapsed() * MOST_SHARE;
            let encoding = self.live.as_ref().map_or(Duration::ZERO, Server::encoding);
            let interval = INTERVAL.max(cost).max(encoding * MOST_ENCODING);
            self.next_picture = start + interval;
        }
        self.publish();
    }

    /// Hands over the finished picture.
    pub(in crate::cli) fn last(&mut self, outcome: &Outcome) {
        if self.live.is_none() && self.tev.is_none() {
            return;
        }
        self.state.done = true;
        self.state.left_s = None;
        if self.state.picture != outcome.passes {
            let summary = outcome.errors.as_ref().and_then(|errors| errors.summary());
            self.take(&outcome.film, summary.map(|summary| summary.total()));
        }
        self.publish();
    }

    /// Ends: gives those who are looking a moment to get the last picture.
    pub(in crate::cli) fn close(self) {
        if let Some(tev) = self.tev {
            tev.close();
        }
        if let Some(live) = self.live {
            live.close();
        }
    }

    fn take(&mut self, film: &Film, error: Option<f64>) {
        let picture = Arc::new(Picture::colours_of(film));
        if let Some(tev) = &self.tev {
            tev.offer(&picture);
        }
        self.frame = Arc::new(Frame::new(picture));
        self.state.picture = self.state.pass;
        let error = error.or_else(|| match self.state.integrator {
            Integrator::Path => noise(film),
            // Its samples lie on a grid: that they differ shows edges, not noise.
            _ => None,
        });
        self.state.error = error;
        if let Some(error) = error {
            self.state.history.push((self.state.pass, error));
        }
        if self.state.history.len() > MOST_POINTS {
            let mut place = 0;
            // The first and the last stay.
            self.state.history.retain(|_| {
                place += 1;
                place % 2 == 1
            });
        }
    }

    fn publish(&self) {
        if let Some(live) = &self.live {
            live.publish(&self.state, &self.frame);
        }
    }
}

/// The root of the mean variance of the pixels' means, as a share of the mean radiance; `None` before the second sample.
fn noise(film: &Film) -> Option<f64> {
    let variance = |pixel: &Pixel| pixel.variance_of_mean().element_sum() / 3.0;
    // Collected, so that the order of the sum does not depend on threads.
    let variances: Vec<f64> = film.pixels().par_iter().map(variance).collect();
    let mean = film.mean().element_sum() / 3.0;
    let noise = (variances.iter().sum::<f64>() / variances.len() as f64).sqrt() / mean;
    let known = film.pixels().iter().any(|pixel| pixel.count() >= 2.0);
    (known && noise.is_finite()).then_some(noise)
}
