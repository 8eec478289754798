//! A server for one page on this machine: a fixed list of places, and answers to nobody who came
//! by another name. It takes GET, and POST from a page that knows its secret.
//!
//! Every connection has a thread, a second to be heard in and an end: who is slow or says
//! nothing keeps nobody else waiting for long, and nothing but itself.

use std::{
    hash::{BuildHasher, RandomState},
    io::{self, ErrorKind, Read, Write},
    net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream},
    sync::{
        Arc,
        atomic::{AtomicUsize, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

use super::ViewerError;

/// Bytes of a request's head; a browser's has one or two thousand.
const HEAD_BYTES: usize = 16 << 10;

/// Headers of a request; a browser's has some twenty.
const HEADERS: usize = 64;

/// Time limit of receiving a request.
const HEARD_WITHIN: Duration = Duration::from_secs(5);

/// Time limit of sending an answer, and the extra time for each MiB.
const TAKEN_WITHIN: Duration = Duration::from_secs(10);
const EACH_MIB: Duration = Duration::from_secs(1);

/// Connections at a time; a browser opens six. Others wait until one ends.
const CONNECTIONS: usize = 512;

/// Bytes that a page may send; a stroke has some thousand.
const BODY_BYTES: usize = 1 << 20;

/// Header in which a page tells the server's secret.
const SECRET: &str = "x-secret";

/// Bytes of one write.
const CHUNK: usize = 256 << 10;

/// Content security policy: a page shows nothing but content of this server.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; worker-src blob:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Request {
    /// The path, as it was sent.
    pub path: String,
    /// Entity tag that the browser has cached.
    pub known: Option<String>,
    /// What a page sends; none where it asks.
    pub posted: Option<Vec<u8>>,
}

/// An answer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Response {
    /// HTTP's code and its words.
    pub status: &'static str,
    /// The body's kind.
    pub kind: &'static str,
    /// Entity tag of the body.
    pub tag: Option<String>,
    /// Bytes of the answer.
    pub body: Arc<Vec<u8>>,
}

impl Response {
    /// A body that was there.
    pub fn ok(kind: &'static str, body: impl Into<Vec<u8>>) -> Self {
        Self {
            status: "200 OK",
            kind,
            tag: None,
            body: Arc::new(body.into()),
        }
    }

    /// A file of the page, by the extension of its name.
    pub fn asset(name: &str, text: &str) -> Self {
        let kind = match name.rsplit_once('.') {
            Some((_, "js")) => "text/javascript; charset=utf-8",
            Some((_, "css")) => "text/css; charset=utf-8",
            _ => "text/html; charset=utf-8",
        };
        Self::ok(kind, text.as_bytes())
    }

    /// A line that says why there is none.
    pub fn refused(status: &'static str, why: impl Into<String>) -> Self {
        Self {
            status,
            kind: "text/plain; charset=utf-8",
            tag: None,
            body: Arc::new(why.into().into_bytes()),
        }
    }

    /// There is nothing at this path.
    pub fn not_found() -> Self {
        Self::refused("404 Not Found", "not found")
    }
}

/// Listens on 127.0.0.1.
#[derive(Debug)]
pub struct Server {
    listener: TcpListener,
    asked_as: Names,
    address: SocketAddr,
}

/// Names and secret that a request has to know.
#[derive(Clone, Debug)]
struct Names {
    hosts: Vec<String>,
    /// In the page's address; without one nothing can be sent.
    secret: Option<String>,
}

impl Server {
    /// Takes a port, or one that is free.
    ///
    /// # Errors
    /// [`ViewerError::Port`] where it is taken.
    pub fn bind(port: Option<u16>) -> Result<Self, ViewerError> {
        let taken = |error: io::Error| ViewerError::Port {
            port: port.unwrap_or(0),
            reason: error.to_string(),
        };
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port.unwrap_or(0)));
        let listener = listener.map_err(taken)?;
        let address = listener.local_addr().map_err(taken)?;
        let asked_as = Names {
            hosts: names(address),
            secret: None,
        };
        Ok(Self {
            listener,
            asked_as,
            address,
        })
    }

    /// The same for a page that may send something.
    pub fn taking(mut self) -> Self {
        // Hashes by keys that the system draws at random.
        let random = RandomState::new();
        let halves = [1, 2].map(|half| format!("{:016x}", random.hash_one(half)));
        self.asked_as.secret = Some(halves.concat());
        self
    }

    /// URL of the page.
    pub fn url(&self) -> String {
        let secret = self.asked_as.secret.as_ref();
        let secret = secret.map_or(String::new(), |secret| format!("#{secret}"));
        format!("http://{}/{secret}", self.address)
    }

    /// Answers until the program ends.
    pub fn serve(&self, answer: impl Fn(&Request) -> Response + Send + Sync + 'static) {
        let answer = Arc::new(answer);
        let open = Arc::new(AtomicUsize::new(0));
        let names = self.asked_as.clone();
        for stream in self.listener.incoming() {
            let Ok(stream) = stream else {
                // Such as no more files: they come back.
                thread::sleep(Duration::from_millis(50));
                continue;
            };
            while open.load(Ordering::Acquire) >= CONNECTIONS {
                thread::sleep(Duration::from_millis(10));
            }
            let place = ConnectionSlot::take(&open);
            let (answer, names) = (answer.clone(), names.clone());
            let handled = thread::Builder::new().name("page".to_owned());
            // Where no thread can be had, the connection is closed.
            let _ = handled.spawn(move || {
                let _place = place;
                // Whoever has left needs no answer.
                let _ = handle(stream, &names, &*answer);
            });
        }
    }
}

/// The hosts that a browser may name; it leaves out the port that is HTTP's own.
fn names(address: SocketAddr) -> Vec<String> {
    let port = address.port();
    let mut names = vec![address.to_string(), format!("localhost:{port}")];
    if port == 80 {
        names.extend([address.ip().to_string(), "localhost".to_owned()]);
    }
    names
}

/// One of the connections that may be open.
struct ConnectionSlot(Arc<AtomicUsize>);

impl ConnectionSlot {
    fn take(open: &Arc<AtomicUsize>) -> Self {
        open.fetch_add(1, Ordering::AcqRel);
        Self(open.clone())
    }
}

impl Drop for ConnectionSlot {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::AcqRel);
    }
}

fn handle(
    mut stream: TcpStream,
    names: &Names,
    answer: &dyn Fn(&Request) -> Response,
) -> io::Result<()> {
    let until = Instant::now() + HEARD_WITHIN;
    let (head, mut body) = hear(&mut stream, until)?;
    let answered = match understood(&head, names) {
        Ok((mut request, length)) => {
            if request.posted.is_some() {
                hear_body(&mut stream, &mut body, length, until)?;
                request.posted = Some(body);
            }
            let answered = answer(&request);
            match answered.tag.is_some() && answered.tag == request.known {
                true => Response {
                    status: "304 Not Modified",
                    body: Arc::default(),
                    ..answered
                },
                false => answered,
            }
        }
        Err(refused) => refused,
    };
    tell(&mut stream, &answered)
}

/// The head of a request, up to the empty line or to what is too much, and what came behind it.
fn hear(stream: &mut TcpStream, until: Instant) -> io::Result<(Vec<u8>, Vec<u8>)> {
    let (mut head, mut part) = (Vec::new(), [0; 2048]);
    loop {
        let end = head.windows(4).position(|end| end == b"\r\n\r\n");
        if let Some(end) = end {
            let body = head.split_off(end + 4);
            return Ok((head, body));
        }
        if head.len() >= HEAD_BYTES {
            return Ok((head, Vec::new()));
        }
        let read = read(stream, &mut part, until)?;
        head.extend(&part[..read]);
    }
}

/// The rest of a body of so many bytes.
fn hear_body(
    stream: &mut TcpStream,
    body: &mut Vec<u8>,
    length: usize,
    until: Instant,
) -> io::Result<()> {
    let mut part = [0; 1 << 14];
    while body.len() < length {
        let read = read(stream, &mut part, until)?;
        body.extend(&part[..read]);
    }
    body.truncate(length);
    Ok(())
}

/// Bytes that came, one at least.
fn read(stream: &mut TcpStream, part: &mut [u8], until: Instant) -> io::Result<usize> {
    stream.set_read_timeout(Some(left(until)?))?;
    match stream.read(part)? {
        0 => Err(ErrorKind::UnexpectedEof.into()),
        read => Ok(read),
    }
}

/// Writes an answer and ends the connection.
fn tell(stream: &mut TcpStream, answer: &Response) -> io::Result<()> {
    let mib = u32::try_from(answer.body.len() >> 20).unwrap_or(u32::MAX);
    let until = Instant::now() + TAKEN_WITHIN + EACH_MIB.saturating_mul(mib);
    let tag = answer.tag.as_ref();
    let tag = tag.map_or(String::new(), |tag| format!("ETag: {tag}\r\n"));
    let head = format!(
        "HTTP/1.1 {}\r\nContent-Type: {}\r\nContent-Length: {}\r\n{tag}Cache-Control: no-store\r\nContent-Security-Policy: {POLICY}\r\nX-Content-Type-Options: nosniff\r\nReferrer-Policy: no-referrer\r\nCross-Origin-Resource-Policy: same-origin\r\nCross-Origin-Opener-Policy: same-origin\r\nAllow: GET\r\nConnection: close\r\n\r\n",
        answer.status,
        answer.kind,
        answer.body.len(),
    );
    for mut left_over in [head.as_bytes(), &answer.body] {
        while !left_over.is_empty() {
            stream.set_write_timeout(Some(left(until)?))?;
            match stream.write(&left_over[..left_over.len().min(CHUNK)])? {
                0 => return Err(ErrorKind::WriteZero.into()),
                written => left_over = &left_over[written..],
            }
        }
    }
    stream.flush()
}

/// Time left until a deadline.
fn left(until: Instant) -> io::Result<Duration> {
    let left = until.saturating_duration_since(Instant::now());
    match left.is_zero() {
        true => Err(ErrorKind::TimedOut.into()),
        false => Ok(left),
    }
}

/// Parses a head that came to one of our names, and the length of what follows: a page of another
/// site that had its name lead here is refused. What changes anything comes from our page, and knows
/// its secret.
fn understood(head: &[u8], names: &Names) -> Result<(Request, usize), Response> {
    let bad = || Response::refused("400 Bad Request", "this is no HTTP request");
    let mut headers = [httparse::EMPTY_HEADER; HEADERS];
    let mut request = httparse::Request::new(&mut headers);
    match request.parse(head) {
        Ok(httparse::Status::Complete(_)) => {}
        Ok(httparse::Status::Partial) | Err(httparse::Error::TooManyHeaders) => {
            let status = "431 Request Header Fields Too Large";
            return Err(Response::refused(status, "the request is too long"));
        }
        Err(_) => return Err(bad()),
    }
    let named = |name: &str| -> Vec<&[u8]> {
        let headers = request.headers.iter();
        let named = headers.filter(|header| header.name.eq_ignore_ascii_case(name));
        named.map(|header| header.value).collect()
    };
    let hosts = named("host");
    let ours =
        |host: &[u8]| (names.hosts.iter()).any(|name| host.eq_ignore_ascii_case(name.as_bytes()));
    if hosts.len() != 1 || !ours(hosts[0]) {
        let why = format!("this page is at http://{}/ only", names.hosts[0]);
        return Err(Response::refused("421 Misdirected Request", why));
    }
    let one = |name: &str| match named(name)[..] {
        [value] => std::str::from_utf8(value).ok(),
        _ => None,
    };
    let posted = match (request.method, &names.secret) {
        (Some("GET"), _) => None,
        (Some("POST"), Some(secret)) => {
            let origin = one("origin").and_then(|origin| origin.strip_prefix("http://"));
            let own = origin.is_some_and(|origin| ours(origin.as_bytes()));
            if !own || one(SECRET) != Some(secret) {
                let why = "open the page at the whole address that the program has printed";
                return Err(Response::refused("403 Forbidden", why));
            }
            Some(Vec::new())
        }
        _ => return Err(Response::refused("405 Method Not Allowed", "GET only")),
    };
    let length = match (&posted, one("content-length").map(str::parse)) {
        (None, _) => 0,
        (Some(_), Some(Ok(length))) if length <= BODY_BYTES => length,
        (Some(_), Some(_)) => {
            return Err(Response::refused(
                "413 Content Too Large",
                "this is too much",
            ));
        }
        (Some(_), None) => {
            return Err(Response::refused("411 Length Required", "of what length?"));
        }
    };
    let known = one("if-none-match").map(str::to_owned);
    let path = request.path.ok_or_else(bad)?.to_owned();
    Ok((
        Request {
            path,
            known,
            posted,
        },
        length,
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asked_as(port: u16, secret: Option<&str>) -> Names {
        Names {
            hosts: names((Ipv4Addr::LOCALHOST, port).into()),
            secret: secret.map(str::to_owned),
        }
    }

    fn status(head: &str) -> &'static str {
        status_at(4000, head)
    }

    fn status_at(port: u16, head: &str) -> &'static str {
        let refused = understood(head.as_bytes(), &asked_as(port, None));
        refused.map_or_else(|refused| refused.status, |_| "200 OK")
    }

    #[test]
    fn who_may_ask_for_what() {
        let get = |host: &str| format!("GET /a HTTP/1.1\r\nHost: {host}\r\n\r\n");
        for host in ["127.0.0.1:4000", "localhost:4000", "LOCALHOST:4000"] {
            assert_eq!(status(&get(host)), "200 OK", "{host}");
        }
        for host in [
            "evil.example",
            "evil.example:4000",
            "127.0.0.1",
            "127.0.0.1:4001",
            "localhost:4000.evil.example",
            "",
        ] {
            assert_eq!(status(&get(host)), "421 Misdirected Request", "{host}");
        }
        for host in ["127.0.0.1", "localhost", "localhost:80"] {
            assert_eq!(status_at(80, &get(host)), "200 OK", "{host}");
        }
        assert_eq!(status("GET / HTTP/1.1\r\n\r\n"), "421 Misdirected Request");
        let twice = "GET / HTTP/1.1\r\nHost: localhost:4000\r\nHost: evil.example\r\n\r\n";
        assert_eq!(status(twice), "421 Misdirected Request");
        let post = "POST / HTTP/1.1\r\nHost: localhost:4000\r\n\r\n";
        assert_eq!(status(post), "405 Method Not Allowed");
        assert_eq!(status("what?\r\n\r\n"), "400 Bad Request");
        let many = "a: b\r\n".repeat(HEADERS + 1);
        let many = format!("GET / HTTP/1.1\r\n{many}\r\n");
        assert_eq!(status(&many), "431 Request Header Fields Too Large");
    }

    #[test]
    fn what_is_known_is_told() {
        let head =
            "GET /scene.json HTTP/1.1\r\nHost: localhost:4000\r\nIf-None-Match: \"a\"\r\n\r\n";
        let (request, _) = understood(head.as_bytes(), &asked_as(4000, None)).unwrap();
        assert_eq!(request.path, "/scene.json");
        assert_eq!(request.known.as_deref(), Some("\"a\""));
    }

    #[test]
    fn only_a_page_that_knows_the_secret_sends_something() {
        let status = |headers: &str| {
            let head = format!("POST /a HTTP/1.1\r\nHost: localhost:4000\r\n{headers}\r\n");
            let found = understood(head.as_bytes(), &asked_as(4000, Some("abc")));
            found.map_err(|refused| refused.status)
        };
        let own = "Origin: http://127.0.0.1:4000\r\nX-Secret: abc\r\n";
        let (request, length) = status(&format!("{own}Content-Length: 12\r\n")).unwrap();
        assert_eq!((request.posted, length), (Some(Vec::new()), 12));
        for headers in [
            "",
            "X-Secret: abc\r\nContent-Length: 2\r\n",
            "Origin: http://127.0.0.1:4000\r\nContent-Length: 2\r\n",
            "Origin: http://evil.example\r\nX-Secret: abc\r\nContent-Length: 2\r\n",
            "Origin: http://127.0.0.1:4001\r\nX-Secret: abc\r\nContent-Length: 2\r\n",
            "Origin: null\r\nX-Secret: abc\r\nContent-Length: 2\r\n",
            "Origin: http://127.0.0.1:4000\r\nX-Secret: abd\r\nContent-Length: 2\r\n",
        ] {
            assert_eq!(status(headers).unwrap_err(), "403 Forbidden", "{headers}");
        }
        let twice = format!("{own}X-Secret: abc\r\nContent-Length: 2\r\n");
        assert_eq!(status(&twice).unwrap_err(), "403 Forbidden");
        assert_eq!(status(own).unwrap_err(), "411 Length Required");
        for length in ["1048577", "99999999999999999999", "-1", "x"] {
            let head = format!("{own}Content-Length: {length}\r\n");
            assert_eq!(
                status(&head).unwrap_err(),
                "413 Content Too Large",
                "{length}"
            );
        }
    }
}
