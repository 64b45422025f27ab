//! Pictures sent to the tev viewer, and viewers that are absent, leave or stall.

use super::support::{Folder, MIXED};
use photolathe::image::exr;
use std::io::Read;
use std::net::{TcpListener, TcpStream};
use std::thread;

/// Reads a packet from its start.
struct Packet {
    bytes: Vec<u8>,
    at: usize,
}

impl Packet {
    /// The next packet, whose first four bytes are its length; `None` at the end.
    fn read(stream: &mut TcpStream) -> Option<Self> {
        let mut length = [0; 4];
        stream.read_exact(&mut length).ok()?;
        let length = u32::from_le_bytes(length) as usize;
        assert!(length < 1 << 20, "tev starts with a buffer of a mebibyte");
        let mut bytes = vec![0; length - 4];
        stream.read_exact(&mut bytes).expect("a whole packet");
        Some(Self { bytes, at: 0 })
    }

    fn take<const N: usize>(&mut self) -> [u8; N] {
        self.at += N;
        self.bytes[self.at - N..self.at]
            .try_into()
            .expect("so many bytes")
    }

    fn byte(&mut self) -> u8 {
        self.take::<1>()[0]
    }

    fn int(&mut self) -> usize {
        i32::from_le_bytes(self.take())
            .try_into()
            .expect("not negative")
    }

    fn long(&mut self) -> usize {
        i64::from_le_bytes(self.take())
            .try_into()
            .expect("not negative")
    }

    fn text(&mut self) -> String {
        let end = self.bytes[self.at..]
            .iter()
            .position(|&byte| byte == 0)
            .expect("an end");
        let text = String::from_utf8(self.bytes[self.at..self.at + end].to_vec()).expect("text");
        self.at += end + 1;
        text
    }

    fn texts(&mut self) -> Vec<String> {
        let count = self.int();
        (0..count).map(|_| self.text()).collect()
    }
}

/// What a viewer shows when the render is over.
#[derive(Default)]
struct Viewed {
    names: Vec<String>,
    size: (usize, usize),
    rgb: Vec<[f32; 3]>,
    packets: usize,
}

/// Takes part as tev does.
fn view(mut stream: TcpStream) -> Viewed {
    let mut viewed = Viewed::default();
    while let Some(mut packet) = Packet::read(&mut stream) {
        let kind = packet.byte();
        packet.byte();
        viewed.names.push(packet.text());
        match kind {
            4 => {
                viewed.size = (packet.int(), packet.int());
                assert_eq!(packet.texts(), ["R", "G", "B"]);
                viewed.rgb = vec![[f32::NAN; 3]; viewed.size.0 * viewed.size.1];
            }
            6 => {
                assert_eq!(packet.texts(), ["R", "G", "B"]);
                let [x, y, width, height] = [(); 4].map(|()| packet.int());
                let offsets = [(); 3].map(|()| packet.long());
                let steps = [(); 3].map(|()| packet.long());
                let floats: Vec<f32> = packet.bytes[packet.at..]
                    .chunks_exact(4)
                    .map(|four| f32::from_le_bytes(four.try_into().expect("four")))
                    .collect();
                assert_eq!(floats.len(), 3 * width * height);
                for pixel in 0..width * height {
                    let place = (y + pixel / width) * viewed.size.0 + x + pixel % width;
                    viewed.rgb[place] = [0, 1, 2].map(|c| floats[offsets[c] + pixel * steps[c]]);
                }
            }
            other => panic!("a packet of kind {other}"),
        }
        viewed.packets += 1;
    }
    viewed
}

fn render(folder: &Folder, port: u16, more: &[&str]) -> (Option<i32>, String) {
    let address = format!("127.0.0.1:{port}");
    let base = ["render", "scene.toml", "-o", "a.exr", "--tev", &address];
    folder.run(&[&base[..], more].concat())
}

fn listen() -> (TcpListener, u16) {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = listener.local_addr().expect("its address").port();
    (listener, port)
}

fn warnings(said: &str) -> usize {
    said.lines().filter(|line| line.contains("tev")).count()
}

#[test]
fn tev_ends_with_the_pixels_of_the_file() {
    // Rows of several packets.
    let text = MIXED
        .replace("width = 24", "width = 300")
        .replace("height = 18", "height = 200");
    let folder = Folder::new(&format!("title = \"cup\"\n{text}"));
    let (listener, port) = listen();
    let viewer = thread::spawn(move || view(listener.accept().expect("a client").0));
    let (code, said) = render(&folder, port, &["--integrator", "path", "--spp", "4"]);
    assert_eq!((code, warnings(&said)), (Some(0), 0), "{said}");
    let viewed = viewer.join().expect("packets as tev reads them");
    assert!(viewed.names.iter().all(|name| name == "photolathe cup"));
    assert!(viewed.packets >= 3, "{}", viewed.packets);
    let picture = exr::read(&folder.path("a.exr")).expect("a picture");
    assert_eq!(viewed.size, (picture.width, picture.height));
    assert!(viewed.rgb == picture.rgb);
}

/// Absent, gone at once, and there but never reading: one warning at most, and the picture is made.
#[test]
fn without_tev_the_render_goes_on() {
    let folder = Folder::new(MIXED);
    let method = ["--integrator", "path", "--spp", "8"];
    let (listener, port) = listen();
    drop(listener);
    let (code, said) = render(&folder, port, &method);
    assert_eq!((code, warnings(&said)), (Some(0), 1), "{said}");

    let (listener, port) = listen();
    let viewer = thread::spawn(move || drop(listener.accept()));
    let (code, said) = render(&folder, port, &method);
    assert!(code == Some(0) && warnings(&said) <= 1, "{said}");
    viewer.join().expect("a client came");

    // More than the buffers on the way hold.
    let (listener, port) = listen();
    let large = [
        "--set",
        "film.width=1600",
        "--set",
        "film.height=1200",
        "--integrator",
        "whitted",
        "--aa",
        "none",
    ];
    let (code, said) = render(&folder, port, &large);
    assert_eq!((code, warnings(&said)), (Some(0), 1), "{said}");
    drop(listener);
    assert!(folder.path("a.exr").exists());

    let (code, said) = folder.run(&["render", "scene.toml", "--tev", "a:b"]);
    assert!(code == Some(2) && said.contains("--tev"), "{said}");
}
