//! A server on loopback that shows a running program in the page.

mod channel;
mod error;
mod files;
mod frame;
mod http;

use channel::Channel;
pub use error::ViewerError;
pub use files::{PAGE_VARIABLE, find_page};
pub use frame::Frame;
use serde_json::Value;
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

/// Connections at a time. A page opens up to six.
const MOST: usize = 64;
/// Bytes of randomness in a token.
const TOKEN: usize = 16;

/// Shows simulations in the page at [`Viewer::url`], for this computer only, until it is dropped.
///
/// The address contains a random token, and only pages with the token can watch. They cannot change anything.
pub struct Viewer {
    address: SocketAddr,
    token: String,
    channel: Arc<Channel>,
    thread: Option<JoinHandle<()>>,
}

/// Data of all connections.
struct Shared {
    page: PathBuf,
    token: String,
    port: u16,
    channel: Arc<Channel>,
    connections: AtomicUsize,
}

impl Viewer {
    /// Starts to serve the page in a folder, see [`find_page`]. Port 0 takes any free one.
    ///
    /// # Errors
    /// If the folder has no page, or the port is taken.
    pub fn start(page: &Path, port: u16) -> Result<Viewer, ViewerError> {
        let page = files::check(page)?;
        let listener =
            TcpListener::bind((Ipv4Addr::LOCALHOST, port)).map_err(|error| ViewerError::Port { port, error })?;
        let address = listener.local_addr().map_err(|error| ViewerError::Port { port, error })?;
        let token = token()?;
        let channel = Arc::new(Channel::default());
        let (connections, port) = (AtomicUsize::new(0), address.port());
        let shared = Arc::new(Shared { page, token: token.clone(), port, channel: channel.clone(), connections });
        let thread = std::thread::Builder::new().name("viewer".into()).spawn(move || accept(&listener, &shared));
        let thread = thread.map_err(|error| ViewerError::Port { port, error })?;
        Ok(Viewer { address, token, channel, thread: Some(thread) })
    }

    /// Address of the page, which has the token.
    pub fn url(&self) -> String {
        format!("http://{}/#/live?token={}", self.address, self.token)
    }

    /// Whether a page watches. If none does, frames need not be made.
    pub fn is_watched(&self) -> bool {
        self.channel.is_watched()
    }

    /// Describes what the next frames show. Pages start over. `title` names it, `model` is [`facts`](crate::facts) of its
    /// model, and `dt` the seconds between two frames.
    pub fn show(&self, title: &str, model: &Value, agents: usize, dt: f64) {
        self.channel.show(frame::scene(title, model, agents, dt));
    }

    /// Shows a frame. Pages that are not ready for it take a later one.
    pub fn frame(&self, frame: &Frame<'_>) {
        self.channel.frame(frame.encode());
    }

    /// Lays the ground of an agent: elevations of a height field of the model, as in
    /// [`HField::data`](marathon_physics::model::HField::data).
    pub fn ground(&self, agent: usize, field: usize, elevations: &[f32]) {
        self.channel.ground((agent, field), frame::ground(agent, field, elevations));
    }

    /// Shows the curve of a run: `{"total": steps, "steps": [..], "return_mean": [..], "speed_mean": [..]}`.
    pub fn curve(&self, curve: &Value) {
        self.channel.curve(frame::message(frame::CURVE, curve.to_string().as_bytes()));
    }
}

impl Drop for Viewer {
    fn drop(&mut self) {
        self.channel.close();
        // wakes the thread that accepts
        let _ = TcpStream::connect_timeout(&self.address, Duration::from_secs(1));
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// A random token in hexadecimal digits.
fn token() -> Result<String, ViewerError> {
    let mut bytes = [0; TOKEN];
    getrandom::fill(&mut bytes).map_err(|error| ViewerError::Random(error.to_string()))?;
    Ok(bytes.iter().map(|byte| format!("{byte:02x}")).collect())
}

/// Gives each connection a thread.
fn accept(listener: &TcpListener, shared: &Arc<Shared>) {
    for stream in listener.incoming() {
        if shared.channel.is_closed() {
            return;
        }
        let Ok(stream) = stream else {
            // no more files, for example
            std::thread::sleep(Duration::from_millis(100));
            continue;
        };
        if shared.connections.fetch_add(1, Ordering::Relaxed) >= MOST {
            shared.connections.fetch_sub(1, Ordering::Relaxed);
            continue;
        }
        let own = shared.clone();
        let connection = std::thread::Builder::new().name("viewer page".into()).spawn(move || {
            // a browser that has gone away is no fault
            let _ = own.answer(stream);
            own.connections.fetch_sub(1, Ordering::Relaxed);
        });
        if connection.is_err() {
            shared.connections.fetch_sub(1, Ordering::Relaxed);
        }
    }
}

impl Shared {
    fn answer(&self, mut stream: TcpStream) -> std::io::Result<()> {
        http::set_up(&stream)?;
        let request = match http::read(&mut stream) {
            Ok(request) => request,
            Err(http::Bad { status, text }) => return http::refuse(&mut stream, status, &text),
        };
        // a name that resolves to this computer must not let a stranger's page read from here
        if !request.is_for(self.port) {
            return http::refuse(&mut stream, "403 Forbidden", "This server answers only to its address on loopback.");
        }
        if request.path != "/live" {
            return files::answer(&mut stream, &self.page, &request.path);
        }
        if !same(request.parameter("token").unwrap_or_default(), &self.token) {
            return http::refuse(
                &mut stream,
                "403 Forbidden",
                "The token is wrong; use the address that the program printed.",
            );
        }
        http::begin(&mut stream, "application/octet-stream", None)?;
        self.channel.send(&mut stream)
    }
}

/// Compares in a time that does not depend on where the texts differ.
fn same(a: &str, b: &str) -> bool {
    a.len() == b.len() && a.bytes().zip(b.bytes()).fold(0, |different, (x, y)| different | (x ^ y)) == 0
}
