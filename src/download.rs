//! Fetches a file of known SHA-256 over TLS: it goes on where it was cut off, follows
//! redirects to named hosts only, and is whole or not there.

use std::{
    fs::{File, TryLockError},
    io::{self, Read, Seek, SeekFrom, Write},
    ops::ControlFlow,
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

use crate::{disk, hash};
use ureq::{
    Agent, Body,
    http::{Response, StatusCode, Uri, header},
    tls::{RootCerts, TlsConfig},
};

/// Retries in a row of a transfer that breaks off without much progress.
const TRIES: usize = 3;

/// Bytes of a file whose length the table does not name.
const MOST: u64 = 4 << 30;

/// Bytes that a transfer is to bring while it is judged, and how long that is: a modem is faster.
const LEAST: u64 = 64 << 10;
const JUDGED: Duration = Duration::from_secs(30);

/// No transfer takes longer.
const LONGEST: Duration = Duration::from_secs(24 * 60 * 60);

/// More redirects than any host of files needs.
const MAX_REDIRECTS: usize = 5;

/// Bytes between two looks at the observer.
const BLOCK: usize = 1 << 16;

/// A file to be fetched.
#[derive(Clone, Debug)]
pub(crate) struct DownloadSource<'a> {
    /// URL of the file; `https` only.
    pub url: &'a str,
    /// Its SHA-256 in lower-case hexadecimal.
    pub sha256: &'a str,
    /// Its length, where known.
    pub bytes: Option<u64>,
    /// Hosts that `url` and its redirects may name; `.example.org` stands for all below it.
    pub hosts: &'a [String],
    /// Time limit of a host's silence.
    pub patience: Duration,
}

/// Error of a download.
#[derive(Debug, thiserror::Error)]
pub enum DownloadError {
    /// The connection failed or broke off, again and again.
    #[error("{host}: {reason}{}", kept(*.done))]
    Broken {
        /// Name of the host.
        host: String,
        /// The network's error.
        reason: String,
        /// Bytes that are there and will not be asked for again.
        done: u64,
    },
    /// The host answers with an error status.
    #[error("{url}: the host answers with status {status}")]
    Status {
        /// URL of the request.
        url: String,
        /// The status of HTTP.
        status: u16,
    },
    /// A URL or a redirect leads to a host that is not allowed.
    #[error("{url}: leads to {to}, which is not among the hosts that the table names")]
    Host {
        /// URL of the request.
        url: String,
        /// Target of the redirect.
        to: String,
    },
    /// The file is longer or shorter than it should be.
    #[error("{url}: has {found} bytes instead of {expected}; the file there is another one now")]
    Length {
        /// URL of the request.
        url: String,
        /// Bytes there.
        found: u64,
        /// Bytes expected.
        expected: u64,
    },
    /// The bytes have an unexpected SHA-256.
    #[error("{url}: has SHA-256 {found} instead of {expected}; it was not kept")]
    Hash {
        /// URL of the request.
        url: String,
        /// SHA-256 of the bytes received.
        found: String,
        /// SHA-256 expected.
        expected: String,
    },
    /// Another process is at it.
    #[error("{}: another process is fetching it", path.display())]
    Busy {
        /// The unfinished file.
        path: PathBuf,
    },
    /// The observer said so; what is there is kept.
    #[error("canceled")]
    Canceled,
    /// The file system refused.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
}

/// Note on the bytes kept for the next try.
fn kept(done: u64) -> String {
    match done {
        0 => String::new(),
        _ => format!("; {done} bytes are kept, and the next try continues from there"),
    }
}

fn io_error(path: &Path) -> impl Fn(io::Error) -> DownloadError {
    move |source| DownloadError::Io {
        path: path.to_path_buf(),
        source,
    }
}

/// Fetches a file to `path`, whose folder is made where it is missing. Until it is whole it
/// is `path` with `.part` appended, which a later call goes on with.
///
/// `observe` is told bytes there and bytes in all, where the host says that, first when the
/// host has answered and nothing is fetched yet; it may end the transfer.
pub(crate) fn download(
    source: &DownloadSource<'_>,
    path: &Path,
    observe: &mut dyn FnMut(u64, Option<u64>) -> ControlFlow<()>,
) -> Result<(), DownloadError> {
    if let Some(folder) = path.parent() {
        disk::make_folder(folder).map_err(io_error(folder))?;
    }
    let mut part_name = path.as_os_str().to_owned();
    part_name.push(".part");
    let part_path = PathBuf::from(part_name);
    let failed = io_error(&part_path);
    let mut part = disk::open_in_place(&part_path).map_err(&failed)?;
    match part.try_lock() {
        Ok(()) => {}
        Err(TryLockError::WouldBlock) => {
            return Err(DownloadError::Busy {
                path: part_path.clone(),
            });
        }
        Err(TryLockError::Error(error)) => return Err(failed(error)),
    }
    let outcome = fill(source, &mut part, &failed, observe);
    let nothing = part.metadata().is_ok_and(|metadata| metadata.len() == 0);
    let useless = matches!(
        outcome,
        Err(DownloadError::Hash { .. } | DownloadError::Length { .. })
    );
    match outcome {
        Ok(()) => {
            part.sync_all().map_err(&failed)?;
            disk::rename(&part_path, path).map_err(io_error(path))
        }
        Err(error) => {
            if useless || nothing {
                // What cannot be removed is found out by its hash the next time.
                drop(disk::remove(&part_path));
            }
            Err(error)
        }
    }
}

/// Appends to the unfinished file until it is whole, and checks it.
fn fill(
    source: &DownloadSource<'_>,
    part: &mut File,
    failed: &impl Fn(io::Error) -> DownloadError,
    observe: &mut dyn FnMut(u64, Option<u64>) -> ControlFlow<()>,
) -> Result<(), DownloadError> {
    let agent = agent(source.patience);
    let mut furthest = part.metadata().map_err(failed)?.len();
    let mut in_vain = 0;
    // A file that is whole already was only not renamed.
    while source.bytes != Some(furthest) {
        let error = match transfer(&agent, source, part, failed, observe) {
            Ok(()) => break,
            Err(error @ DownloadError::Broken { .. }) => error,
            Err(error) => return Err(error),
        };
        let there = part.metadata().map_err(failed)?.len();
        in_vain = match there >= furthest + LEAST {
            true => 0,
            false => in_vain + 1,
        };
        if in_vain == TRIES {
            return Err(error);
        }
        furthest = furthest.max(there);
    }
    part.seek(SeekFrom::Start(0)).map_err(failed)?;
    let found = hash::of_file(part).map_err(failed)?;
    if found == source.sha256 {
        return Ok(());
    }
    Err(DownloadError::Hash {
        url: source.url.to_owned(),
        found,
        expected: source.sha256.to_owned(),
    })
}

/// One request for what is missing.
fn transfer(
    agent: &Agent,
    source: &DownloadSource<'_>,
    part: &mut File,
    failed: &impl Fn(io::Error) -> DownloadError,
    observe: &mut dyn FnMut(u64, Option<u64>) -> ControlFlow<()>,
) -> Result<(), DownloadError> {
    let mut done = part.seek(SeekFrom::End(0)).map_err(failed)?;
    let (mut response, host) = ask(agent, source, done)?;
    match response.status() {
        StatusCode::PARTIAL_CONTENT => {}
        // All of it, from the beginning: this host cannot go on.
        StatusCode::OK => {
            disk::step()
                .and_then(|()| part.set_len(0))
                .map_err(failed)?;
            done = part.seek(SeekFrom::Start(0)).map_err(failed)?;
        }
        // Nothing is missing, or what is there is longer than the file.
        StatusCode::RANGE_NOT_SATISFIABLE if done > 0 => return Ok(()),
        status => {
            return Err(DownloadError::Status {
                url: source.url.to_owned(),
                status: status.as_u16(),
            });
        }
    }
    let rest = response.body().content_length();
    let total = rest.map(|rest| done + rest).or(source.bytes);
    if let (Some(found), Some(expected)) = (total, source.bytes)
        && found != expected
    {
        return Err(DownloadError::Length {
            url: source.url.to_owned(),
            found,
            expected,
        });
    }
    let mut body = response.body_mut().as_reader();
    let mut block = vec![0; BLOCK];
    let most = total.unwrap_or(MOST).min(source.bytes.unwrap_or(MOST));
    let mut judged = (Instant::now(), done);
    loop {
        if observe(done, total).is_break() {
            return Err(DownloadError::Canceled);
        }
        let broken = |reason: String| DownloadError::Broken {
            host: host.clone(),
            reason,
            done,
        };
        if !keeps_pace(&mut judged, Instant::now(), done) {
            return Err(broken(format!(
                "it sends fewer than {LEAST} bytes in {} s",
                JUDGED.as_secs()
            )));
        }
        match body.read(&mut block) {
            Ok(0) if total.is_some_and(|total| done < total) => {
                return Err(broken("the transfer was cut off".to_owned()));
            }
            Ok(0) => return Ok(()),
            Ok(count) => {
                disk::step().map_err(failed)?;
                part.write_all(&block[..count]).map_err(failed)?;
                done += count as u64;
            }
            Err(error) => return Err(broken(error.to_string())),
        }
        // A length that nobody told is no reason to fill the disk.
        if done > most || total > Some(most) {
            return Err(DownloadError::Length {
                url: source.url.to_owned(),
                found: total.unwrap_or(0).max(done),
                expected: most,
            });
        }
    }
}

/// True unless a transfer has brought fewer than [`LEAST`] bytes in [`JUDGED`] or longer.
fn keeps_pace(judged: &mut (Instant, u64), now: Instant, bytes: u64) -> bool {
    let (since, before) = *judged;
    if now.duration_since(since) < JUDGED {
        return true;
    }
    *judged = (now, bytes);
    bytes >= before + LEAST
}

/// The answer to a request for the bytes from `done` on, after redirects, and who gave it.
fn ask(
    agent: &Agent,
    source: &DownloadSource<'_>,
    done: u64,
) -> Result<(Response<Body>, String), DownloadError> {
    let mut url = source.url.to_owned();
    for _ in 0..=MAX_REDIRECTS {
        let host = allowed(&url, source)?;
        let mut request = agent.get(&url).header(header::ACCEPT_ENCODING, "identity");
        if done > 0 {
            request = request.header(header::RANGE, format!("bytes={done}-"));
        }
        let response = request.call().map_err(|error| DownloadError::Broken {
            host: host.clone(),
            reason: error.to_string(),
            done,
        })?;
        let target = response.headers().get(header::LOCATION);
        match target.and_then(|target| target.to_str().ok()) {
            Some(target) if response.status().is_redirection() => {
                url = if target.starts_with('/') {
                    format!("https://{host}{target}")
                } else {
                    target.to_owned()
                };
            }
            _ => return Ok((response, host)),
        }
    }
    Err(DownloadError::Host {
        url: source.url.to_owned(),
        to: format!("more than {MAX_REDIRECTS} redirects"),
    })
}

/// The host and port of a URL, if something may be fetched there.
fn allowed(url: &str, source: &DownloadSource<'_>) -> Result<String, DownloadError> {
    let uri: Option<Uri> = url.parse().ok();
    let secure = uri.as_ref().and_then(Uri::scheme_str) == Some("https");
    let authority = uri.as_ref().and_then(Uri::authority);
    let named = |host: &str| {
        let below = |named: &str| named.starts_with('.') && host.ends_with(named);
        (source.hosts.iter()).any(|named| named == host || below(named))
    };
    match authority {
        // Nobody's name and password belong into such a URL.
        Some(authority)
            if secure && named(authority.host()) && !authority.as_str().contains('@') =>
        {
            Ok(authority.as_str().to_owned())
        }
        _ => Err(DownloadError::Host {
            url: source.url.to_owned(),
            to: url.to_owned(),
        }),
    }
}

/// A client that trusts whom the system trusts and looks at every redirect itself. Proxies
/// are those of the environment (`HTTPS_PROXY`, `NO_PROXY`).
fn agent(patience: Duration) -> Agent {
    let tls = TlsConfig::builder().root_certs(RootCerts::PlatformVerifier);
    Agent::config_builder()
        .tls_config(tls.build())
        .https_only(true)
        .max_redirects(0)
        .max_redirects_will_error(false)
        .http_status_as_error(false)
        .user_agent(concat!("gs-chroma/", env!("CARGO_PKG_VERSION")))
        .timeout_connect(Some(patience))
        .timeout_recv_response(Some(patience))
        .timeout_per_read(Some(patience))
        .timeout_recv_body(Some(LONGEST))
        .build()
        .new_agent()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn leads_to(url: &str) -> Option<String> {
        let hosts = ["github.com", ".githubusercontent.com"].map(String::from);
        let source = DownloadSource {
            url: "https://github.com/a",
            sha256: "",
            bytes: None,
            hosts: &hosts,
            patience: Duration::from_secs(1),
        };
        allowed(url, &source).ok()
    }

    #[test]
    fn a_drip_is_no_transfer() {
        let begun = Instant::now();
        let keeps = |rate: u64| {
            let mut judged = (begun, 0);
            let at = |second| begun + Duration::from_secs(second);
            (0..100).all(|second| keeps_pace(&mut judged, at(second), second * rate))
        };
        assert!(keeps(5000) && !keeps(2));
    }

    #[test]
    fn only_named_hosts_and_only_over_tls() {
        for (url, host) in [
            ("https://github.com/x.onnx", "github.com"),
            ("https://github.com:8443/x.onnx", "github.com:8443"),
            (
                "https://a.githubusercontent.com/x?y=z",
                "a.githubusercontent.com",
            ),
        ] {
            assert_eq!(leads_to(url).as_deref(), Some(host));
        }
        for url in [
            "http://github.com/x.onnx",
            "https://githubusercontent.com/x",
            "https://evilgithub.com/x",
            "https://github.com.evil.org/x",
            "https://me:secret@github.com/x",
            "https://github.com@evil.org/x",
            "file:///etc/passwd",
            "nonsense",
            "",
        ] {
            assert_eq!(leads_to(url), None, "{url}");
        }
    }
}
