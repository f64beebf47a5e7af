//! `marathon serve` streams agents to pages that know the token, and slow pages do not hold it up.

use crate::common::{self, json, marathon};
use serde_json::Value;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

/// Kinds of messages.
const SCENE: u8 = 1;
const FRAME: u8 = 2;
const CURVE: u8 = 3;

struct Server {
    process: Child,
    address: String,
    token: String,
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

impl Server {
    /// Serves a policy or a run, with a page that is only a file.
    fn start(folder: &Path, source: &str) -> Server {
        let page = folder.join("page");
        std::fs::create_dir_all(&page).expect("a folder");
        std::fs::write(page.join("index.html"), "<p>the page").expect("a file");
        std::fs::write(folder.join("secret.txt"), "secret").expect("a file");
        let mut process = marathon(folder, &["serve", source, "--page", "page", "--agents", "3", "--json"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("the command starts");
        let mut text = String::new();
        let mut lines = BufReader::new(process.stdout.take().expect("a pipe")).lines();
        while !text.ends_with('}') {
            text.push_str(&lines.next().expect("a line").expect("text"));
        }
        let url = json(&text)["url"].as_str().expect("a text").to_string();
        let (address, token) = url.split_once("/#/live?token=").expect("an address with a token");
        let address = address.strip_prefix("http://").expect("an address").to_string();
        Server { process, address, token: token.into() }
    }

    /// Asks for a path and returns the stream of the answer.
    fn ask(&self, path: &str, host: &str) -> BufReader<TcpStream> {
        let mut stream = TcpStream::connect(&self.address).expect("a connection");
        stream.set_read_timeout(Some(Duration::from_secs(30))).expect("a time");
        write!(stream, "GET {path} HTTP/1.1\r\nHost: {host}\r\n\r\n").expect("a request");
        BufReader::new(stream)
    }

    /// Status and body of a finished answer.
    fn get(&self, path: &str, host: &str) -> (u16, String) {
        let mut text = String::new();
        self.ask(path, host).read_to_string(&mut text).expect("an answer");
        let (head, body) = text.split_once("\r\n\r\n").expect("a head");
        (head.split(' ').nth(1).expect("a status").parse().expect("a number"), body.into())
    }

    /// Opens the stream of messages.
    fn watch(&self) -> BufReader<TcpStream> {
        let mut stream = self.ask(&format!("/live?token={}", self.token), &self.address);
        let mut line = String::new();
        stream.read_line(&mut line).expect("a status");
        assert!(line.contains(" 200 "), "{line}");
        while line != "\r\n" {
            line.clear();
            stream.read_line(&mut line).expect("a line of the head");
        }
        stream
    }
}

fn message(stream: &mut impl Read) -> (u8, Vec<u8>) {
    let mut head = [0; 5];
    stream.read_exact(&mut head).expect("a head");
    let mut content = vec![0; u32::from_le_bytes([head[0], head[1], head[2], head[3]]) as usize];
    stream.read_exact(&mut content).expect("a content");
    (head[4], content)
}

/// The next message of a kind.
fn next(stream: &mut impl Read, kind: u8) -> Vec<u8> {
    std::iter::repeat_with(|| message(stream)).find(|(found, _)| *found == kind).expect("no end").1
}

fn time(frame: &[u8]) -> f64 {
    f64::from_le_bytes(frame[..8].try_into().expect("eight bytes"))
}

fn policy() -> String {
    format!("{}/../../assets/policies/hopper.safetensors", env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn agents_move_in_real_time_and_a_slow_tab_holds_up_nobody() {
    let folder = tempfile::tempdir().expect("a folder");
    let server = Server::start(folder.path(), &policy());
    // never reads
    let _slow = server.watch();
    let mut stream = server.watch();
    let scene: Value = serde_json::from_slice(&next(&mut stream, SCENE)).expect("JSON");
    assert_eq!(scene["agents"], 3);
    let (geoms, bodies) = (&scene["model"]["geoms"], &scene["model"]["bodies"]);
    let matrices = geoms.as_array().expect("geoms").len() + bodies.as_array().expect("bodies").len();
    let first = next(&mut stream, FRAME);
    assert_eq!(first.len(), 8 + 3 * (4 + 4 * 16 * matrices));
    let begin = Instant::now();
    let last = (0..60).map(|_| next(&mut stream, FRAME)).last().expect("frames");
    let (shown, real) = (time(&last) - time(&first), begin.elapsed().as_secs_f64());
    // frames may be missed, but time runs neither ahead nor far behind
    assert!(shown > 0.5 && shown < real + 0.5, "{shown} s in {real} s");
    assert_ne!(first[20..], last[20..]);
}

#[test]
fn strangers_see_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let server = Server::start(folder.path(), &policy());
    let (address, token) = (&server.address, &server.token);
    assert_eq!(server.get("/", address), (200, "<p>the page".into()));
    assert_eq!(server.get("/live", address).0, 403);
    assert_eq!(server.get(&format!("/live?token={}0", &token[1..]), address).0, 403);
    for path in ["/../secret.txt", "/%2e%2e/secret.txt", "/..%2fsecret.txt", "//etc/passwd", "/missing"] {
        assert_eq!(server.get(path, address).0, 404, "{path}");
    }
    // a name that a stranger's page has bent to this computer
    assert_eq!(server.get("/", "example.com").0, 403);
    assert_eq!(server.get(&format!("/live?token={token}"), "example.com").0, 403);
}

#[test]
fn a_run_is_shown_from_its_first_checkpoint_on() {
    let folder = tempfile::tempdir().expect("a folder");
    common::succeed(
        folder.path(),
        &["train", "hopper", "--agents", "64", "--steps", "8192", "--out", "run", "--no-video"],
    );
    let (run, aside) = (folder.path().join("run"), folder.path().join("policy.safetensors"));
    std::fs::rename(run.join("policy.safetensors"), &aside).expect("the policy");
    let server = Server::start(folder.path(), "run");
    let mut stream = server.watch();
    let curve: Value = serde_json::from_slice(&next(&mut stream, CURVE)).expect("JSON");
    assert_eq!(curve["total"], 8192);
    assert_eq!(curve["steps"].as_array().map(Vec::len), Some(2));
    std::fs::rename(&aside, run.join("policy.safetensors")).expect("the policy");
    let scene: Value = serde_json::from_slice(&next(&mut stream, SCENE)).expect("JSON");
    assert_eq!(scene["title"], "Hopper-v0 after 8,192 decisions");
    // a newer policy starts new episodes
    std::fs::copy(policy(), run.join("policy.safetensors")).expect("the policy");
    let scene: Value = serde_json::from_slice(&next(&mut stream, SCENE)).expect("JSON");
    assert_ne!(scene["title"], "Hopper-v0 after 8,192 decisions");
}

#[test]
fn a_missing_page_or_policy_is_an_error() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = common::fail(folder.path(), 1, &["serve", &policy(), "--page", "nowhere"]);
    assert!(text.contains("nowhere: no index.html") && text.contains("web/build.sh"), "{text}");
    std::fs::write(folder.path().join("index.html"), "").expect("a file");
    let text = common::fail(folder.path(), 1, &["serve", "missing", "--page", "."]);
    assert!(text.contains("missing") && text.contains("no such file"), "{text}");
    common::fail(folder.path(), 2, &["serve", &policy(), "--page", ".", "--agents", "0"]);
}
