//! The live page: the film's own pixels, and clients of every kind that change nothing.

use super::support::{Folder, MIXED};
use serde_json::Value;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::process::{Child, ChildStderr, Stdio};
use std::time::Duration;

/// A render that serves its page.
struct Served<'a> {
    folder: &'a Folder,
    child: Child,
    stderr: BufReader<ChildStderr>,
    address: SocketAddr,
}

/// An answer: its head, and its body.
struct Answer {
    head: String,
    body: Vec<u8>,
}

impl Answer {
    fn is(&self, status: &str) -> bool {
        self.head.starts_with(&format!("HTTP/1.1 {status} "))
    }

    fn header(&self, name: &str) -> Option<&str> {
        let mut lines = self.head.lines();
        lines.find_map(|line| line.strip_prefix(name)?.strip_prefix(": "))
    }
}

impl<'a> Served<'a> {
    fn start(folder: &'a Folder, arguments: &[&str]) -> Self {
        let base = ["render", "scene.toml", "--live", "127.0.0.1:0"];
        let mut command = folder.command(&[&base[..], arguments].concat());
        let mut child = command
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program starts");
        let mut stderr = BufReader::new(child.stderr.take().expect("a pipe"));
        let mut line = String::new();
        let address = loop {
            line.clear();
            assert!(
                stderr.read_line(&mut line).expect("text") > 0,
                "no address is said"
            );
            if let Some((_, address)) = line.split_once("http://") {
                break address
                    .trim_end_matches(['/', '\n'])
                    .parse()
                    .expect("an address");
            }
        };
        Self {
            folder,
            child,
            stderr,
            address,
        }
    }

    fn connect(&self) -> TcpStream {
        TcpStream::connect(self.address).expect("the page is served")
    }

    /// What a request is answered; `None` if the server is gone.
    fn ask(&self, request: &[u8]) -> Option<Answer> {
        let mut stream = TcpStream::connect(self.address).ok()?;
        stream
            .set_read_timeout(Some(Duration::from_secs(60)))
            .ok()?;
        stream.write_all(request).ok()?;
        let mut bytes = Vec::new();
        stream.read_to_end(&mut bytes).ok()?;
        let end = bytes.windows(4).position(|four| four == b"\r\n\r\n")?;
        let answer = Answer {
            head: String::from_utf8_lossy(&bytes[..end]).into_owned(),
            body: bytes.split_off(end + 4),
        };
        let length = answer
            .header("Content-Length")
            .and_then(|length| length.parse().ok());
        assert_eq!(length, Some(answer.body.len()), "{}", answer.head);
        Some(answer)
    }

    fn get(&self, path: &str) -> Option<Answer> {
        self.ask(format!("GET {path} HTTP/1.1\r\nHost: here\r\n\r\n").as_bytes())
    }

    /// The state once it is as wanted.
    fn state(&self, wanted: impl Fn(&Value) -> bool) -> Value {
        loop {
            let answer = self.get("/state.json").expect("the render goes on");
            let state: Value = serde_json::from_slice(&answer.body).expect("JSON");
            if wanted(&state) {
                return state;
            }
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// The end: exit code, and what else was said.
    fn end(mut self) -> (Option<i32>, String) {
        let mut said = String::new();
        self.stderr.read_to_string(&mut said).expect("text");
        (self.child.wait().expect("an end").code(), said)
    }

    fn file(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.folder.path(name)).expect("a file")
    }
}

/// A scene whose passes take a few milliseconds.
fn scene() -> String {
    let text = MIXED
        .replace("width = 24", "width = 96")
        .replace("height = 18", "height = 72");
    format!("title = \"a <ball> & a lamp\"\n{text}")
}

/// The picture of the page is, byte by byte, the file that the render would have written then; the rest of the page is there; and
/// what is no question gets an answer that says so.
#[test]
fn the_page_shows_the_film_and_refuses_what_it_does_not_know() {
    let folder = Folder::new(&scene());
    let method = ["--integrator", "path", "--seed", "3", "--exposure", "0.7"];
    let mut served = Served::start(&folder, &[&method[..], &["--spp", "1000000000"]].concat());
    let state = served.state(|state| state["picture"].as_u64() > Some(1));
    assert_eq!(state["title"], "a <ball> & a lamp");
    assert_eq!(state["planned"], 1_000_000_000);
    assert_eq!(
        (&state["integrator"], &state["done"]),
        (&"path".into(), &false.into())
    );
    assert!(state["rays_per_s"].as_f64() > Some(0.0) && state["left_s"].as_f64() > Some(0.0));
    assert!(
        state["error"].as_f64() > Some(0.0) && !state["history"].as_array().unwrap().is_empty()
    );

    let picture = served.get("/picture.png?pass=5").expect("a picture");
    assert!(picture.is("200") && picture.header("Content-Type") == Some("image/png"));
    let passes = picture.header("Photolathe-Pass").expect("the passes in it");
    let page = served.get("/").expect("a page");
    let text = String::from_utf8(page.body.clone()).expect("text");
    assert!(page.is("200") && text.contains("a &lt;ball&gt; &amp; a lamp"));
    for elsewhere in ["http://", "https://", "src=\"//"] {
        // The names of XML's vocabularies are no addresses.
        let text = text.replace("http://www.w3.org/2000/svg", "");
        assert!(!text.contains(elsewhere), "{elsewhere}");
    }

    for (request, status) in [
        (&b"GET /other HTTP/1.1\r\n\r\n"[..], "404"),
        (b"GET /../../etc/passwd HTTP/1.1\r\n\r\n", "404"),
        (b"POST / HTTP/1.1\r\nContent-Length: 5\r\n\r\nhello", "405"),
        (b"DELETE /picture.png HTTP/1.1\r\n\r\n", "405"),
        (b"\x16\x03\x01\x02\x00\x01\x00\r\n\r\n", "400"),
        (b"GET\r\n\r\n", "400"),
        (
            &[b"GET / HTTP/1.1\r\nCookie: ".to_vec(), vec![b'a'; 1 << 20]].concat(),
            "431",
        ),
    ] {
        // Who sends a whole mebibyte may be cut off while at it.
        let answer = served.ask(request);
        assert!(
            answer.is_none() && status == "431" || answer.is_some_and(|answer| answer.is(status)),
            "{status}"
        );
    }
    served.state(|state| state["picture"].as_u64() > Some(2));
    served.child.kill().expect("an end");

    let again = [
        &["render", "scene.toml", "-o", "again.png", "--spp", passes],
        &method[..],
    ]
    .concat();
    assert_eq!(folder.run(&again).0, Some(0));
    assert!(
        served.file("again.png") == picture.body,
        "after {passes} passes"
    );
}

/// Clients that ask for the picture and never read it, that connect and say nothing, that send garbage: as many as are served and
/// more. The files are those of a render without a page.
#[test]
fn clients_that_stall_change_neither_the_course_nor_the_bytes() {
    let folder = Folder::new(&scene());
    let method = [
        "--integrator",
        "sppm",
        "--passes",
        "40",
        "--photons",
        "20000",
    ];
    let plain = ["render", "scene.toml", "-o", "plain.png", "-o", "plain.exr"];
    assert_eq!(folder.run(&[&plain[..], &method[..]].concat()).0, Some(0));
    let outputs = ["-o", "served.png", "-o", "served.exr"];
    let served = Served::start(&folder, &[&outputs[..], &method[..]].concat());
    let mut clients = Vec::new();
    let mut stall = |count: usize| {
        for number in 0..count {
            let mut client = served.connect();
            let words: &[u8] = match number % 3 {
                0 => b"GET /picture.png HTTP/1.1\r\n\r\n",
                1 => b"",
                _ => b"\0\0\0\0\0\0\0\0",
            };
            // Who is turned away at once cannot even ask.
            let _ = client.write_all(words);
            clients.push(client);
        }
    };
    stall(9);
    let state = served.get("/state.json").expect("an answer");
    assert!(state.is("200"));
    stall(31);
    let file = |name: &str| std::fs::read(folder.path(name)).expect("a file");
    let (code, said) = served.end();
    assert_eq!(code, Some(0), "{said}");
    for kind in ["png", "exr"] {
        assert!(
            file(&format!("served.{kind}")) == file(&format!("plain.{kind}")),
            "{kind}"
        );
    }
    // Those beyond the sixteen that are served together were told so.
    let turned_away = clients.into_iter().filter_map(|mut client: TcpStream| {
        let mut bytes = [0; 12];
        client.read_exact(&mut bytes).ok()?;
        (bytes == *b"HTTP/1.1 503").then_some(())
    });
    assert!(turned_away.count() > 0);
}

/// `whitted` makes its picture in one pass: those who look see that it is under way, and at the end the picture.
#[test]
fn a_picture_of_one_pass_is_seen_at_the_end() {
    let folder = Folder::new(&scene());
    let method = [
        "--integrator",
        "whitted",
        "--aa",
        "uniform",
        "--pattern",
        "4x4",
        "-o",
        "a.png",
    ];
    let size = ["--set", "film.width=480", "--set", "film.height=360"];
    let served = Served::start(&folder, &[&method[..], &size[..]].concat());
    let before = served.state(|_| true);
    if before["picture"] == 0 {
        assert!(served.get("/picture.png").expect("an answer").is("404"));
    }
    let state = served.state(|state| state["done"] == true);
    assert_eq!(
        (&state["pass"], &state["picture"], &state["error"]),
        (&1.into(), &1.into(), &Value::Null)
    );
    let picture = served.get("/picture.png").expect("the last picture");
    let file = |name: &str| std::fs::read(folder.path(name)).expect("a file");
    assert_eq!(served.end().0, Some(0));
    assert!(file("a.png") == picture.body);
}

#[test]
fn an_address_that_cannot_be_had_is_an_error_before_anything_is_rendered() {
    let folder = Folder::new(&scene());
    let taken = TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = taken.local_addr().expect("its address").port().to_string();
    let render = |live: &str| {
        let short = ["--integrator", "path", "--spp", "1", "-o", "a.png"];
        folder.run(&[&["render", "scene.toml", "--live", live], &short[..]].concat())
    };
    for address in [port.as_str(), "192.0.2.1:8080"] {
        let (code, said) = render(address);
        assert_eq!(code, Some(2), "{said}");
        assert!(
            said.contains("--live") && said.lines().count() == 1,
            "{said}"
        );
        assert!(!folder.path("a.png").exists());
    }
    let (code, said) = render("nowhere");
    assert!(code == Some(2) && said.contains("--live"), "{said}");
    // Other machines are let in only by an address that lets them, and that is said.
    let (code, said) = render("0.0.0.0:0");
    assert!(
        code == Some(0) && said.contains("whoever reaches this machine"),
        "{said}"
    );
    let (code, said) = render("0");
    assert!(
        code == Some(0) && said.contains("http://127.0.0.1:") && !said.contains("whoever"),
        "{said}"
    );
}
