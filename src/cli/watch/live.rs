//! The live page: a few threads that answer browsers while the render goes on.
//!
//! The render leaves its latest picture in `Shared` and never waits here; clients get it from threads of their own, of which there
//! are few, and each of which ends on time however slow its client is. They end with the process.

use super::http::{self, Answer};
use crate::image::picture::Picture;
use crate::image::png;
use crate::lab::page;
use crate::numeric::clock::ThreadClock;
use crate::render::driver::Progress;
use crate::scene::options::Integrator;
use anyhow::Context;
use serde::Serialize;
use std::net::{TcpListener, TcpStream};
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

const PAGE: &str = include_str!("live.html");
const SCRIPT: &str = include_str!("live.js");
/// The page may load nothing from elsewhere.
const POLICY: &str = "Content-Security-Policy: default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; \
                      img-src 'self' data:; connect-src 'self'\r\n";
/// Clients served together; browsers open up to six connections each.
const MOST_CLIENTS: usize = 16;
/// A page that asked this short a time ago is still being looked at; it asks every second.
const RECENT: Duration = Duration::from_secs(3);
/// What those who look get at the end, to see the last picture.
const FAREWELL: Duration = Duration::from_millis(1500);

/// Reads what `--live` is given: a port, or an address and a port.
pub fn address(text: &str) -> Result<String, String> {
    match text.parse::<u16>() {
        Ok(port) => Ok(format!("127.0.0.1:{port}")),
        Err(_) => super::host_and_port(text),
    }
}

/// Where a render stands, as the page gets it.
#[derive(Clone, Debug, Serialize)]
pub(super) struct State {
    title: String,
    pub(super) integrator: Integrator,
    /// Passes done.
    pub(super) pass: u64,
    /// `None` if time alone limits the run.
    planned: Option<u64>,
    seconds: f64,
    pub(super) rays_per_s: f64,
    /// As a share of the mean radiance.
    pub(super) error: Option<f64>,
    pub(super) left_s: Option<f64>,
    /// Passes in the picture; 0 if there is none yet.
    pub(super) picture: u64,
    /// Whether the render has ended.
    pub(super) done: bool,
    /// Passes and errors.
    pub(super) history: Vec<(u64, f64)>,
}

impl State {
    /// Before the first pass.
    pub(super) fn new(title: &str, integrator: Integrator) -> Self {
        Self {
            title: title.to_owned(),
            integrator,
            pass: 0,
            planned: None,
            seconds: 0.0,
            rays_per_s: 0.0,
            error: None,
            left_s: None,
            picture: 0,
            done: false,
            history: Vec::new(),
        }
    }

    /// Takes note of a pass; `limit` is the time after which the render ends.
    pub(super) fn note(&mut self, progress: &Progress, limit: Option<f64>) {
        let Progress {
            done,
            planned,
            seconds,
            ..
        } = *progress;
        self.pass = done;
        self.seconds = seconds;
        self.planned = (planned != u64::MAX).then_some(planned);
        let by_passes = |planned: u64| seconds / done as f64 * (planned - done) as f64;
        let by_passes = self.planned.map(by_passes);
        let by_time = limit.map(|limit| (limit - seconds).max(0.0));
        self.left_s = by_passes.into_iter().chain(by_time).reduce(f64::min);
    }
}

/// A picture with what is made of it.
#[derive(Default)]
pub(super) struct Frame {
    picture: Arc<Picture>,
    /// Encoded when the first client asks for it.
    png: OnceLock<Result<Vec<u8>, String>>,
}

/// What the render has left for the clients.
struct Shown {
    state: State,
    frame: Arc<Frame>,
    since: Instant,
}

struct Shared {
    page: String,
    exposure: f64,
    shown: Mutex<Arc<Shown>>,
    clients: AtomicUsize,
    /// When a page last asked.
    asked: Mutex<Option<Instant>>,
    /// CPU time that the last PNG took.
    encoding_ns: AtomicU64,
}

/// Serves the page.
pub(super) struct Server(Arc<Shared>);

/// What the page asks for again and again.
#[derive(Serialize)]
struct Report<'a> {
    #[serde(flatten)]
    state: &'a State,
    /// Seconds since then.
    age_s: f64,
}

impl Server {
    /// Starts to serve at an address, and says on stderr where.
    ///
    /// # Errors
    /// If the address cannot be had.
    pub(super) fn open(address: &str, state: &State, exposure: f64) -> anyhow::Result<Self> {
        let cannot = || format!("--live {address}: cannot serve the page there");
        let listener = TcpListener::bind(address).with_context(cannot)?;
        let at = listener.local_addr().with_context(cannot)?;
        let page = page::fill(
            PAGE,
            serde_json::json!({ "title": state.title, "code": SCRIPT }),
        )?;
        let shared = Arc::new(Shared {
            page,
            exposure,
            shown: Mutex::new(Arc::new(Shown::new(state, &Arc::default()))),
            clients: AtomicUsize::new(0),
            asked: Mutex::new(None),
            encoding_ns: AtomicU64::new(0),
        });
        eprintln!("photolathe: watch the render at http://{at}/");
        if !at.ip().is_loopback() {
            eprintln!("photolathe: whoever reaches this machine can see the picture there");
        }
        let served = Arc::clone(&shared);
        thread::Builder::new()
            .name("live".to_owned())
            .spawn(move || accept(&listener, &served))
            .with_context(cannot)?;
        Ok(Self(shared))
    }

    /// Leaves news for the clients. The lock is held for no more than the copy of a reference, on either side.
    pub(super) fn publish(&self, state: &State, frame: &Arc<Frame>) {
        let shown = Arc::new(Shown::new(state, frame));
        *lock(&self.0.shown) = shown;
    }

    /// CPU time that the last PNG took to encode.
    pub(super) fn encoding(&self) -> Duration {
        Duration::from_nanos(self.0.encoding_ns.load(Ordering::Relaxed))
    }

    /// Ends: at once, or if a page was looked at just now, when it has had time to get the last picture.
    pub(super) fn close(self) {
        let asked = *lock(&self.0.asked);
        if asked.is_some_and(|asked| asked.elapsed() < RECENT) {
            thread::sleep(FAREWELL);
        }
    }
}

/// Nothing is left half done by a thread that panics here.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn accept(listener: &TcpListener, shared: &Arc<Shared>) {
    for stream in listener.incoming() {
        let Ok(mut stream) = stream else {
            // Too many open files, or a client gone already: neither is mended by haste.
            thread::sleep(Duration::from_millis(50));
            continue;
        };
        match Guest::of(shared) {
            Some(guest) => {
                let thread = thread::Builder::new().name("live client".to_owned());
                // Without a thread the client is dropped.
                let _ = thread.spawn(move || guest.serve(&mut stream));
            }
            None => http::turn_away(&mut stream),
        }
    }
}

/// One of the clients being served, until dropped.
struct Guest(Arc<Shared>);

impl Guest {
    /// `None` if there are as many as may be.
    fn of(shared: &Arc<Shared>) -> Option<Self> {
        let guest = Self(Arc::clone(shared));
        (shared.clients.fetch_add(1, Ordering::SeqCst) < MOST_CLIENTS).then_some(guest)
    }

    /// Answers one request. What goes wrong is the client's affair.
    fn serve(&self, stream: &mut TcpStream) {
        let _ = http::asked(stream).and_then(|asked| match asked {
            Ok(path) => self.answer(&path, stream),
            Err(refusal) => http::answer(stream, &Answer::refusal(refusal)),
        });
    }

    fn answer(&self, path: &str, stream: &mut TcpStream) -> std::io::Result<()> {
        let shared = &*self.0;
        let shown = Arc::clone(&lock(&shared.shown));
        match path {
            "/" => {
                let page = Answer::of("text/html; charset=utf-8", shared.page.as_bytes());
                let headers = POLICY.to_owned();
                http::answer(stream, &Answer { headers, ..page })
            }
            "/state.json" => {
                *lock(&shared.asked) = Some(Instant::now());
                let report = Report {
                    state: &shown.state,
                    age_s: shown.since.elapsed().as_secs_f64(),
                };
                let json = serde_json::to_vec(&report)?;
                http::answer(stream, &Answer::of("application/json", &json))
            }
            "/picture.png" if shown.state.picture > 0 => match shown.frame.png(shared) {
                Ok(bytes) => {
                    let headers = format!("Photolathe-Pass: {}\r\n", shown.state.picture);
                    let picture = Answer::of("image/png", bytes);
                    http::answer(stream, &Answer { headers, ..picture })
                }
                Err(_) => http::answer(stream, &Answer::refusal(http::TROUBLE)),
            },
            _ => http::answer(stream, &Answer::refusal(http::ABSENT)),
        }
    }
}

impl Drop for Guest {
    fn drop(&mut self) {
        self.0.clients.fetch_sub(1, Ordering::SeqCst);
    }
}

impl Shown {
    fn new(state: &State, frame: &Arc<Frame>) -> Self {
        Self {
            state: state.clone(),
            frame: Arc::clone(frame),
            since: Instant::now(),
        }
    }
}

impl Frame {
    pub(super) fn new(picture: Arc<Picture>) -> Self {
        Self {
            picture,
            png: OnceLock::new(),
        }
    }

    /// The bytes that the PNG file of this picture would have.
    fn png(&self, shared: &Shared) -> &Result<Vec<u8>, String> {
        self.png.get_or_init(|| {
            let clock = ThreadClock::start();
            let bytes = png::encode(&self.picture, shared.exposure);
            let took = 1e9 * clock.seconds();
            shared.encoding_ns.store(took as u64, Ordering::Relaxed);
            bytes
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_port_alone_is_one_that_no_other_machine_reaches() {
        assert_eq!(address("8080").as_deref(), Ok("127.0.0.1:8080"));
        assert_eq!(address("0.0.0.0:80").as_deref(), Ok("0.0.0.0:80"));
        assert_eq!(address("[::1]:80").as_deref(), Ok("[::1]:80"));
        for wrong in ["", ":80", "localhost", "localhost:", "a:66000", "70000"] {
            assert!(address(wrong).is_err(), "{wrong}");
        }
    }
}
