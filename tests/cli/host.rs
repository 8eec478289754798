//! A host of files on this machine that speaks TLS, and does what hosts do.

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use rustls::pki_types::{PrivateKeyDer, pem::PemObject};
use rustls::{ServerConfig, ServerConnection, StreamOwned};

use super::program::{Done, Place};

/// Answer to a request.
#[derive(Clone)]
pub enum Answer {
    /// The file, from the requested offset.
    File(Vec<u8>),
    /// The whole file, whatever the requested offset.
    Always(Vec<u8>),
    /// So many bytes of the answer, then the connection closes.
    CutOff(Vec<u8>, usize),
    /// So many bytes, then silence.
    Silent(Vec<u8>, usize),
    /// The file in pieces with pauses between them.
    Slow(Vec<u8>),
    /// Somewhere else.
    Redirect(String),
    /// An error of HTTP.
    Status(&'static str),
}

/// Answers for each path, in turn; the last of them again and again.
type Answers = Vec<(&'static str, Vec<Answer>)>;

/// A host that is up as long as this process.
pub struct Host {
    pub port: u16,
    certificate: PathBuf,
    /// Paths that were asked for, and the byte from where on.
    asked: Arc<Mutex<Vec<(String, u64)>>>,
}

impl Host {
    /// Starts one; `answers` is given its address, `https://localhost:PORT`.
    pub fn start(place: &Place, answers: impl FnOnce(&str) -> Answers) -> Self {
        let made = rcgen::generate_simple_self_signed(["localhost".to_owned()]).expect("made");
        let certificate = place.path("certificate.pem");
        fs::write(&certificate, made.cert.pem()).expect("writable");
        let key = PrivateKeyDer::from_pem_slice(made.signing_key.serialize_pem().as_bytes());
        let provider = Arc::new(rustls::crypto::ring::default_provider());
        let config = ServerConfig::builder_with_provider(provider)
            .with_safe_default_protocol_versions()
            .expect("TLS")
            .with_no_client_auth()
            .with_single_cert(vec![made.cert.der().clone()], key.expect("a key"))
            .expect("a certificate");
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        let port = listener.local_addr().expect("an address").port();
        let answers = answers(&format!("https://localhost:{port}"));
        let answers = Arc::new(Mutex::new(answers));
        let (config, asked) = (Arc::new(config), Arc::new(Mutex::new(Vec::new())));
        let log = asked.clone();
        thread::spawn(move || {
            for stream in listener.incoming().flatten() {
                let (config, answers, log) = (config.clone(), answers.clone(), log.clone());
                // Who hangs up is no concern of the host's.
                thread::spawn(move || drop(serve(stream, config, &answers, &log)));
            }
        });
        Self {
            port,
            certificate,
            asked,
        }
    }

    /// Requests so far: path and offset.
    pub fn asked(&self) -> Vec<(String, u64)> {
        self.asked.lock().expect("no panic").clone()
    }

    /// Runs the program in a world where this host is trusted and the table in `table.toml`
    /// is the one of networks.
    pub fn run(&self, place: &Place, arguments: &[&str]) -> Done {
        Done::of(self.command(place, arguments).output())
    }

    /// The same, not yet started.
    pub fn command(&self, place: &Place, arguments: &[&str]) -> Command {
        let mut command = place.command(arguments);
        // ONNX Runtime stays where it is.
        let runtime = place.path("cache/gs-chroma/onnxruntime");
        if let Some(home) = std::env::home_dir().filter(|_| !runtime.exists()) {
            let folder = std::env::var_os("XDG_CACHE_HOME")
                .map_or_else(|| home.join(".cache"), PathBuf::from);
            fs::create_dir_all(place.path("cache/gs-chroma")).expect("writable");
            std::os::unix::fs::symlink(folder.join("gs-chroma/onnxruntime"), &runtime)
                .expect("writable");
        }
        command
            .stdin(Stdio::null())
            .env("SSL_CERT_FILE", &self.certificate)
            .env("GS_CHROMA_TEACHERS", place.path("table.toml"))
            .env("XDG_CACHE_HOME", place.path("cache"));
        for proxy in ["HTTPS_PROXY", "https_proxy", "ALL_PROXY", "all_proxy"] {
            command.env_remove(proxy);
        }
        command
    }
}

fn serve(
    stream: TcpStream,
    config: Arc<ServerConfig>,
    answers: &Mutex<Answers>,
    log: &Mutex<Vec<(String, u64)>>,
) -> std::io::Result<()> {
    let connection = ServerConnection::new(config).map_err(std::io::Error::other)?;
    let mut stream = BufReader::new(StreamOwned::new(connection, stream));
    let mut head = String::new();
    while !head.ends_with("\r\n\r\n") {
        if stream.read_line(&mut head)? == 0 {
            return Ok(());
        }
    }
    let path = head.split(' ').nth(1).unwrap_or_default().to_owned();
    let lower = head.to_lowercase();
    let from = lower
        .split("range: bytes=")
        .nth(1)
        .and_then(|rest| rest.split('-').next()?.parse().ok());
    log.lock()
        .expect("no panic")
        .push((path.clone(), from.unwrap_or(0)));
    let answer = {
        let mut answers = answers.lock().expect("no panic");
        let found = answers.iter_mut().find(|(own, _)| *own == path);
        match found.map(|(_, answers)| answers) {
            Some(answers) if answers.len() > 1 => answers.remove(0),
            Some(answers) => answers[0].clone(),
            None => Answer::Status("404 Not Found"),
        }
    };
    let stream = stream.get_mut();
    match answer {
        Answer::File(bytes) => part(stream, &bytes, from, usize::MAX),
        Answer::Always(bytes) => part(stream, &bytes, None, usize::MAX),
        Answer::CutOff(bytes, count) => part(stream, &bytes, from, count),
        Answer::Silent(bytes, count) => {
            part(stream, &bytes, from, count)?;
            thread::sleep(Duration::from_secs(60));
            Ok(())
        }
        Answer::Slow(bytes) => {
            write!(
                stream,
                "HTTP/1.1 200 OK\r\nContent-Length: {}\r\n\r\n",
                bytes.len()
            )?;
            for piece in bytes.chunks(bytes.len().div_ceil(5)) {
                stream.write_all(piece)?;
                stream.flush()?;
                thread::sleep(Duration::from_millis(300));
            }
            Ok(())
        }
        Answer::Redirect(to) => write!(
            stream,
            "HTTP/1.1 302 Found\r\nLocation: {to}\r\nContent-Length: 0\r\n\r\n"
        ),
        Answer::Status(status) => {
            write!(stream, "HTTP/1.1 {status}\r\nContent-Length: 0\r\n\r\n")
        }
    }
}

/// The file from a byte on, or as much of it.
fn part(
    stream: &mut (impl Read + Write),
    bytes: &[u8],
    from: Option<u64>,
    count: usize,
) -> std::io::Result<()> {
    let start = from.unwrap_or(0) as usize;
    if from.is_some() && start >= bytes.len() {
        let status = "416 Range Not Satisfiable";
        return write!(stream, "HTTP/1.1 {status}\r\nContent-Length: 0\r\n\r\n");
    }
    let rest = &bytes[start..];
    let status = match from {
        Some(_) => "206 Partial Content",
        None => "200 OK",
    };
    write!(
        stream,
        "HTTP/1.1 {status}\r\nContent-Length: {}\r\n\r\n",
        rest.len()
    )?;
    stream.write_all(&rest[..count.min(rest.len())])?;
    stream.flush()
}
