//! As much of HTTP as the page needs: one GET per connection.

use std::borrow::Cow;
use std::io::{Read, Result, Write};
use std::net::TcpStream;
use std::time::Duration;

/// Longest head of a request, bytes.
const HEAD: usize = 16 * 1024;
/// Most header lines.
const LINES: usize = 64;
/// Time for a request.
const READING: Duration = Duration::from_secs(5);
/// Time in which a page must take some bytes.
const WRITING: Duration = Duration::from_secs(10);

/// A request.
pub struct Request {
    /// Path, decoded, such as `/index.html`.
    pub path: String,
    query: String,
    host: String,
}

/// Why a request is refused.
pub struct Bad {
    pub status: &'static str,
    pub text: String,
}

impl Bad {
    fn request(text: impl Into<String>) -> Bad {
        Bad { status: "400 Bad Request", text: text.into() }
    }
}

impl Request {
    /// Whether the browser was sent to this server by its own address.
    pub fn is_for(&self, port: u16) -> bool {
        ["127.0.0.1", "localhost"].iter().any(|name| self.host == format!("{name}:{port}"))
    }

    /// A parameter after the `?`.
    pub fn parameter(&self, name: &str) -> Option<&str> {
        self.query.split('&').find_map(|part| part.strip_prefix(name)?.strip_prefix('='))
    }
}

/// Sets limits of time.
pub fn set_up(stream: &TcpStream) -> Result<()> {
    stream.set_read_timeout(Some(READING))?;
    stream.set_write_timeout(Some(WRITING))?;
    // frames are small and wanted now
    stream.set_nodelay(true)
}

/// Reads the head of a request.
pub fn read(stream: &mut impl Read) -> std::result::Result<Request, Bad> {
    let mut head = vec![0; HEAD];
    let mut length = 0;
    loop {
        let count = stream.read(&mut head[length..]).map_err(|error| Bad::request(error.to_string()))?;
        if count == 0 {
            return Err(match length == HEAD {
                true => Bad { status: "431 Request Header Fields Too Large", text: format!("more than {HEAD} bytes") },
                false => Bad::request("the request has no end"),
            });
        }
        length += count;
        if let Some(request) = parse(&head[..length])? {
            return Ok(request);
        }
    }
}

/// Parses the head of a request; `None` if it is incomplete.
fn parse(head: &[u8]) -> std::result::Result<Option<Request>, Bad> {
    let mut lines = [httparse::EMPTY_HEADER; LINES];
    let mut request = httparse::Request::new(&mut lines);
    let status = request.parse(head).map_err(|error| Bad::request(error.to_string()))?;
    if status.is_partial() {
        return Ok(None);
    }
    if request.method != Some("GET") {
        return Err(Bad { status: "405 Method Not Allowed", text: "only GET is known".into() });
    }
    let (path, query) =
        request.path.unwrap_or_default().split_once('?').unwrap_or((request.path.unwrap_or_default(), ""));
    let path = decode(path).ok_or_else(|| Bad::request("the path is not UTF-8"))?.into_owned();
    let host = request.headers.iter().find(|line| line.name.eq_ignore_ascii_case("host"));
    let host = host.map_or_else(String::new, |line| String::from_utf8_lossy(line.value).to_ascii_lowercase());
    Ok(Some(Request { path, query: query.to_string(), host }))
}

/// Replaces `%XX`.
fn decode(text: &str) -> Option<Cow<'_, str>> {
    if !text.contains('%') {
        return Some(text.into());
    }
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.bytes();
    while let Some(byte) = rest.next() {
        let digit = |byte: Option<u8>| char::from(byte?).to_digit(16);
        bytes.push(match byte {
            b'%' => (digit(rest.next())? * 16 + digit(rest.next())?) as u8,
            byte => byte,
        });
    }
    String::from_utf8(bytes).ok().map(Cow::Owned)
}

/// Writes the head of an answer. Without a length, the answer lasts as long as the connection.
pub fn begin(stream: &mut impl Write, kind: &str, length: Option<u64>) -> Result<()> {
    let length = length.map_or_else(String::new, |length| format!("Content-Length: {length}\r\n"));
    let head = format!(
        "HTTP/1.1 200 OK\r\nContent-Type: {kind}\r\n{length}Cache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\n\
         Cross-Origin-Resource-Policy: same-origin\r\nConnection: close\r\n\r\n"
    );
    stream.write_all(head.as_bytes())
}

/// Refuses a request with a sentence.
pub fn refuse(stream: &mut impl Write, status: &str, text: &str) -> Result<()> {
    let length = text.len();
    let head = format!(
        "HTTP/1.1 {status}\r\nContent-Type: text/plain; charset=utf-8\r\nContent-Length: {length}\r\nConnection: close\r\n\r\n"
    );
    stream.write_all(head.as_bytes())?;
    stream.write_all(text.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn request(text: &str) -> std::result::Result<Request, Bad> {
        read(&mut text.as_bytes())
    }

    #[test]
    fn requests_are_read() {
        let Ok(found) = request("GET /a%20b?x=1&token=ab HTTP/1.1\r\nHost: LOCALHOST:80\r\n\r\n") else {
            panic!("refused")
        };
        assert_eq!(found.path, "/a b");
        assert_eq!(found.parameter("token"), Some("ab"));
        assert_eq!(found.parameter("tok"), None);
        assert!(found.is_for(80) && !found.is_for(81));
    }

    #[test]
    fn bad_requests_are_refused() {
        let status = |text: &str| request(text).err().map(|bad| bad.status);
        assert_eq!(status("POST / HTTP/1.1\r\n\r\n"), Some("405 Method Not Allowed"));
        assert_eq!(status("GET / HTTP/1.1\r\n"), Some("400 Bad Request"));
        assert_eq!(status("\u{0}\u{1}"), Some("400 Bad Request"));
        assert_eq!(status("GET /%ff HTTP/1.1\r\n\r\n"), Some("400 Bad Request"));
        assert_eq!(status("GET /%zz HTTP/1.1\r\n\r\n"), Some("400 Bad Request"));
        let long = format!("GET / HTTP/1.1\r\nA: {}\r\n\r\n", "a".repeat(HEAD));
        assert_eq!(status(&long), Some("431 Request Header Fields Too Large"));
    }
}
