//! Pictures for the tev viewer (Müller, github.com/Tom94/tev), by its protocol over TCP.
//!
//! A packet is its length in bytes with these four (u32), its kind (u8), whether to raise the window (u8), the name of the picture
//! ending with 0, and what the kind needs; numbers are little-endian.
//!
//! ```text
//! create: width, height, channels (i32 each), the name of each channel ending with 0
//! update: channels (i32), their names, x, y, width, height (i32 each), offset of each channel in floats (i64),
//!         step of each from pixel to pixel (i64), the floats
//! ```
//!
//! A thread of its own sends; the render leaves it the latest picture and never waits.

use crate::image::picture::Picture;
use std::io::{ErrorKind, Result, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::sync::mpsc::{self, Receiver};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

/// Where tev listens if not told otherwise.
const PORT: u16 = 14158;
const CREATE: u8 = 4;
const UPDATE: u8 = 6;
const CHANNELS: [&str; 3] = ["R", "G", "B"];
/// Bytes of pixels in a packet, at least a row: within the buffer that tev starts with.
const MOST_BYTES: usize = 1 << 19;
/// How long tev may take to answer a call, and to take anything at all.
const PATIENCE: Duration = Duration::from_secs(3);
/// How long the end of the render waits for tev to take the last picture.
const FAREWELL: Duration = Duration::from_secs(10);

/// Reads what `--tev` is given: a host, or a host and a port.
pub fn address(text: &str) -> std::result::Result<String, String> {
    match text.contains(':') {
        true => super::host_and_port(text),
        false => super::host_and_port(&format!("{text}:{PORT}")),
    }
}

/// What the render has left to be sent.
#[derive(Default)]
struct Left {
    picture: Option<Arc<Picture>>,
    ended: bool,
}

#[derive(Default)]
struct Slot {
    left: Mutex<Left>,
    changed: Condvar,
}

/// Sends pictures to tev.
pub(super) struct Sender {
    slot: Arc<Slot>,
    /// Closed when the thread has ended.
    thread: Receiver<()>,
}

impl Sender {
    /// Starts to call tev. Failure is said on stderr, once.
    pub(super) fn open(address: String, title: &str) -> Self {
        let slot = Arc::<Slot>::default();
        let (alive, thread) = mpsc::channel();
        let left = Arc::clone(&slot);
        // The name ends with the first 0.
        let name = format!("photolathe {}", title.replace('\0', " "));
        let send = move || {
            let _alive = alive;
            if let Err(error) = Link::open(&address, name).and_then(|link| link.send_all(&left)) {
                eprintln!(
                    "photolathe: tev at {address} cannot be reached: the render goes on without it ({error})"
                );
            }
        };
        // Without a thread nothing is sent.
        let _ = thread::Builder::new().name("tev".to_owned()).spawn(send);
        Self { slot, thread }
    }

    /// Leaves a picture to be sent, in place of one that is not sent yet.
    pub(super) fn offer(&self, picture: &Arc<Picture>) {
        self.slot
            .change(|left| left.picture = Some(Arc::clone(picture)));
    }

    /// Ends when the last picture is sent, or tev does not take it.
    pub(super) fn close(self) {
        self.slot.change(|left| left.ended = true);
        // Nothing is ever sent on this channel: it ends with the thread.
        let _ = self.thread.recv_timeout(FAREWELL);
    }
}

impl Slot {
    /// The lock is held for no more than an assignment, on either side.
    fn change(&self, change: impl FnOnce(&mut Left)) {
        change(&mut self.left.lock().unwrap_or_else(PoisonError::into_inner));
        self.changed.notify_one();
    }

    /// The next picture; `None` when there will be none.
    fn next(&self) -> Option<Arc<Picture>> {
        let left = self.left.lock().unwrap_or_else(PoisonError::into_inner);
        let nothing = |left: &mut Left| left.picture.is_none() && !left.ended;
        let left = self.changed.wait_while(left, nothing);
        left.unwrap_or_else(PoisonError::into_inner).picture.take()
    }
}

struct Link {
    stream: TcpStream,
    name: String,
}

impl Link {
    fn open(address: &str, name: String) -> Result<Self> {
        let mut last = ErrorKind::AddrNotAvailable.into();
        for address in address.to_socket_addrs()? {
            match TcpStream::connect_timeout(&address, PATIENCE) {
                Ok(stream) => {
                    stream.set_write_timeout(Some(PATIENCE))?;
                    return Ok(Self { stream, name });
                }
                Err(error) => last = error,
            }
        }
        Err(last)
    }

    fn send_all(mut self, slot: &Slot) -> Result<()> {
        let mut created = false;
        while let Some(picture) = slot.next() {
            if !created {
                self.stream.write_all(&create(&self.name, &picture))?;
                created = true;
            }
            let rows = (MOST_BYTES / (12 * picture.width)).max(1);
            for first in (0..picture.height).step_by(rows) {
                let count = rows.min(picture.height - first);
                self.stream
                    .write_all(&update(&self.name, &picture, first, count))?;
            }
        }
        Ok(())
    }
}

/// The packet that opens the picture in tev.
fn create(name: &str, picture: &Picture) -> Vec<u8> {
    packet(CREATE, true, name, |body| {
        numbers(body, &[picture.width, picture.height, CHANNELS.len()]);
        CHANNELS.iter().for_each(|channel| text(body, channel));
    })
}

/// The packet that sets `count` rows from `first` on.
fn update(name: &str, picture: &Picture, first: usize, count: usize) -> Vec<u8> {
    packet(UPDATE, false, name, |body| {
        numbers(body, &[CHANNELS.len()]);
        CHANNELS.iter().for_each(|channel| text(body, channel));
        numbers(body, &[0, first, picture.width, count]);
        for offset in [0_i64, 1, 2] {
            body.extend(offset.to_le_bytes());
        }
        for _ in CHANNELS {
            body.extend((CHANNELS.len() as i64).to_le_bytes());
        }
        let rows = &picture.rgb[first * picture.width..(first + count) * picture.width];
        body.extend(
            rows.as_flattened()
                .iter()
                .flat_map(|value| value.to_le_bytes()),
        );
    })
}

fn packet(kind: u8, raise: bool, name: &str, fill: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
    let mut bytes = vec![0; 4];
    bytes.extend([kind, u8::from(raise)]);
    text(&mut bytes, name);
    fill(&mut bytes);
    let length = bytes.len() as u32;
    bytes[..4].copy_from_slice(&length.to_le_bytes());
    bytes
}

fn text(body: &mut Vec<u8>, text: &str) {
    body.extend(text.as_bytes());
    body.push(0);
}

/// Film sizes and rows are far below 2³¹.
fn numbers(body: &mut Vec<u8>, numbers: &[usize]) {
    for &number in numbers {
        body.extend((number as i32).to_le_bytes());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_host_alone_gets_the_usual_port() {
        assert_eq!(address("viewer").as_deref(), Ok("viewer:14158"));
        assert_eq!(address("127.0.0.1:9").as_deref(), Ok("127.0.0.1:9"));
        for wrong in ["", ":9", "viewer:", "viewer:x"] {
            assert!(address(wrong).is_err(), "{wrong}");
        }
    }

    /// Byte by byte, from the description above.
    #[test]
    fn packets_have_the_layout_that_tev_reads() {
        let picture = Picture {
            width: 1,
            height: 2,
            rgb: vec![[1.0, 2.0, 3.0], [0.5, 0.0, -1.0]],
            ..Picture::default()
        };
        let mut expected = vec![26, 0, 0, 0, 4, 1, b'n', 0];
        expected.extend([1, 0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0]);
        expected.extend(b"R\0G\0B\0");
        assert_eq!(create("n", &picture), expected);
        let packet = update("n", &picture, 1, 1);
        let mut expected = vec![94, 0, 0, 0, 6, 0, b'n', 0, 3, 0, 0, 0];
        expected.extend(b"R\0G\0B\0");
        expected.extend([0, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0]);
        for number in [0_u8, 1, 2, 3, 3, 3] {
            expected.extend([number, 0, 0, 0, 0, 0, 0, 0]);
        }
        expected.extend([0, 0, 0, 0x3F, 0, 0, 0, 0, 0, 0, 0x80, 0xBF]);
        assert_eq!(packet, expected);
    }
}
