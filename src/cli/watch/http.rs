//! As much of HTTP/1.1 (RFC 9112) as a page needs that is only looked at: GET, one request a connection, every wait with an end.

use std::io::{Error, ErrorKind, Read, Result, Write};
use std::net::{Shutdown, TcpStream};
use std::time::{Duration, Instant};

/// Longest request line with its headers; browsers send about one KiB.
const MOST_HEAD: usize = 8 << 10;
/// How long a client may take to ask, to take the whole answer, and to hang up.
const ASKING: Duration = Duration::from_secs(3);
const ANSWERING: Duration = Duration::from_secs(10);
const LEAVING: Duration = Duration::from_secs(1);
const AWAY: Duration = Duration::from_millis(50);
/// What is read and thrown away of a client that still talks after its answer.
const MOST_REST: usize = 64 << 10;

/// An answer.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Answer<'a> {
    /// Status code with its reason.
    pub(super) status: &'static str,
    /// Type of the body.
    pub(super) content: &'static str,
    /// Further header lines, each with its line end.
    pub(super) headers: String,
    /// The body.
    pub(super) body: &'a [u8],
}

impl<'a> Answer<'a> {
    /// An answer of this type.
    pub(super) fn of(content: &'static str, body: &'a [u8]) -> Self {
        Self {
            status: "200 OK",
            content,
            headers: String::new(),
            body,
        }
    }

    /// An answer that says why there is none; it says so in its body too.
    pub(super) fn refusal(status: &'static str) -> Self {
        let headers = match status {
            METHOD => "Allow: GET\r\n".to_owned(),
            _ => String::new(),
        };
        Self {
            status,
            content: "text/plain; charset=utf-8",
            headers,
            body: status.as_bytes(),
        }
    }

    fn head(&self) -> String {
        format!(
            "HTTP/1.1 {}\r\nContent-Type: {}\r\nContent-Length: {}\r\nConnection: close\r\nCache-Control: no-store\r\n\
             X-Content-Type-Options: nosniff\r\n{}\r\n",
            self.status,
            self.content,
            self.body.len(),
            self.headers
        )
    }
}

/// Why a request gets no other answer.
pub(super) const BAD: &str = "400 Bad Request";
pub(super) const ABSENT: &str = "404 Not Found";
pub(super) const METHOD: &str = "405 Method Not Allowed";
pub(super) const LONG: &str = "431 Request Header Fields Too Large";
pub(super) const TROUBLE: &str = "500 Internal Server Error";
pub(super) const BUSY: &str = "503 Service Unavailable";

/// What a client asks for: the path without its query, or why it cannot be told.
///
/// # Errors
/// If the client does not end its request in time, or is gone.
pub(super) fn asked(stream: &mut TcpStream) -> Result<std::result::Result<String, &'static str>> {
    let deadline = Instant::now() + ASKING;
    let mut head = Vec::new();
    let mut buffer = [0; 1024];
    loop {
        stream.set_read_timeout(Some(left(deadline)?))?;
        let count = stream.read(&mut buffer)?;
        if count == 0 {
            return Err(ErrorKind::UnexpectedEof.into());
        }
        // The blank line may stand across two readings.
        let from = head.len().saturating_sub(3);
        head.extend_from_slice(&buffer[..count]);
        if head[from..].windows(4).any(|four| four == b"\r\n\r\n") {
            return Ok(path(&head));
        }
        if head.len() > MOST_HEAD {
            return Ok(Err(LONG));
        }
    }
}

fn path(head: &[u8]) -> std::result::Result<String, &'static str> {
    let line = head.split(|&byte| byte == b'\r').next().unwrap_or(head);
    let line = std::str::from_utf8(line).map_err(|_| BAD)?;
    let words: Vec<&str> = line.split(' ').collect();
    match words[..] {
        [method, target, "HTTP/1.1" | "HTTP/1.0"] if target.starts_with('/') => match method {
            "GET" => Ok(target.split('?').next().unwrap_or(target).to_owned()),
            _ => Err(METHOD),
        },
        _ => Err(BAD),
    }
}

/// Sends an answer and hangs up.
///
/// # Errors
/// If the client does not take it in time, or is gone.
pub(super) fn answer(stream: &mut TcpStream, answer: &Answer) -> Result<()> {
    let deadline = Instant::now() + ANSWERING;
    send(stream, answer.head().as_bytes(), deadline)?;
    send(stream, answer.body, deadline)?;
    stream.shutdown(Shutdown::Write)?;
    hear_out(stream)
}

/// Sends a client away that is one too many.
pub(super) fn turn_away(stream: &mut TcpStream) {
    // The few bytes fit into any buffer, so this waits for no one; a client that is gone misses nothing.
    let refusal = Answer::refusal(BUSY);
    let _ = send(stream, refusal.head().as_bytes(), Instant::now() + AWAY)
        .and_then(|()| send(stream, refusal.body, Instant::now() + AWAY));
}

/// Sends all bytes before the deadline: a client that takes a byte now and then gains nothing.
fn send(stream: &mut TcpStream, mut bytes: &[u8], deadline: Instant) -> Result<()> {
    while !bytes.is_empty() {
        stream.set_write_timeout(Some(left(deadline)?))?;
        match stream.write(bytes) {
            Ok(0) => return Err(ErrorKind::WriteZero.into()),
            Ok(count) => bytes = &bytes[count..],
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(())
}

/// Reads until the client hangs up: to close a connection with bytes unread would tear the answer away from it.
fn hear_out(stream: &mut TcpStream) -> Result<()> {
    let deadline = Instant::now() + LEAVING;
    let mut buffer = [0; 4096];
    let mut rest = 0;
    while rest < MOST_REST {
        stream.set_read_timeout(Some(left(deadline)?))?;
        match stream.read(&mut buffer)? {
            0 => break,
            count => rest += count,
        }
    }
    Ok(())
}

/// The time to a deadline, which is not yet there.
fn left(deadline: Instant) -> Result<Duration> {
    let left = deadline.saturating_duration_since(Instant::now());
    match left.is_zero() {
        true => Err(Error::from(ErrorKind::TimedOut)),
        false => Ok(left),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::rng::{Purpose, Stream};
    use std::net::TcpListener;

    fn pair() -> (TcpStream, TcpStream) {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        let client = TcpStream::connect(listener.local_addr().unwrap()).expect("a connection");
        (client, listener.accept().expect("a client").0)
    }

    fn told(request: &[u8]) -> Option<std::result::Result<String, &'static str>> {
        let (mut client, mut server) = pair();
        client.write_all(request).expect("the request is sent");
        client.shutdown(Shutdown::Write).expect("half is closed");
        asked(&mut server).ok()
    }

    #[test]
    fn a_request_is_its_path() {
        let get =
            |target: &str| told(format!("GET {target} HTTP/1.1\r\nHost: a\r\n\r\n").as_bytes());
        assert_eq!(get("/"), Some(Ok("/".to_owned())));
        assert_eq!(
            get("/picture.png?pass=3"),
            Some(Ok("/picture.png".to_owned()))
        );
        assert_eq!(get("http://elsewhere/"), Some(Err(BAD)));
        assert_eq!(told(b"POST / HTTP/1.1\r\n\r\n"), Some(Err(METHOD)));
        assert_eq!(told(b"GET / HTTP/2\r\n\r\n"), Some(Err(BAD)));
        assert_eq!(told(b"GET /\r\n\r\n"), Some(Err(BAD)));
        assert_eq!(told(b"\xff\xfe / HTTP/1.1\r\n\r\n"), Some(Err(BAD)));
        assert_eq!(told(b"GET / HTTP/1.1\r\n"), None);
        assert_eq!(told(b""), None);
    }

    #[test]
    fn a_request_without_an_end_is_cut_off() {
        let long = [b"GET / HTTP/1.1\r\n".to_vec(), vec![b'a'; 4 * MOST_HEAD]].concat();
        assert_eq!(told(&long), Some(Err(LONG)));
    }

    /// 2000 heads of random bytes, half of them from a start that is right.
    #[test]
    fn garbage_is_refused_or_understood() {
        let mut stream = Stream::new(1, Purpose::Test, 0);
        for number in 0..2000 {
            let mut head = if number % 2 == 0 {
                b"GET / HTTP/1.1\r\nHost: a\r\n\r\n".to_vec()
            } else {
                Vec::new()
            };
            head.extend((0..40).map(|_| stream.next_u64() as u8));
            for _ in 0..3 {
                let at = (stream.uniform() * head.len() as f64) as usize;
                head[at] = stream.next_u64() as u8;
            }
            let _ = path(&head);
        }
    }

    #[test]
    fn a_client_that_never_reads_is_given_up() {
        let (client, mut server) = pair();
        let bytes = vec![0; 64 << 20];
        let deadline = Instant::now() + Duration::from_millis(50);
        assert!(send(&mut server, &bytes, deadline).is_err());
        drop(client);
    }

    #[test]
    fn an_answer_reaches_a_client_that_still_talks() {
        let (mut client, mut server) = pair();
        client
            .write_all(&[b'x'; 20_000])
            .expect("the request is sent");
        let from_server = std::thread::spawn(move || {
            let told = asked(&mut server).expect("a request");
            answer(&mut server, &Answer::refusal(told.expect_err("no request")))
        });
        let mut text = String::new();
        client.read_to_string(&mut text).expect("an answer");
        assert!(
            text.starts_with("HTTP/1.1 431 ") && text.ends_with(LONG),
            "{text}"
        );
        drop(client);
        assert!(from_server.join().expect("no panic").is_ok());
    }
}
