//! From the program to the pages. Each kind of message keeps only its newest one, so a slow page misses frames and does not
//! hold up the program.

use super::frame::{ALIVE, message};
use std::collections::BTreeMap;
use std::io::{Result, Write};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Time after which a page hears that the program is still there.
const QUIET: Duration = Duration::from_secs(2);

/// A message and its number.
#[derive(Clone, Default)]
struct Latest {
    number: u64,
    bytes: Option<Arc<Vec<u8>>>,
}

#[derive(Default)]
struct State {
    /// Number of the newest message.
    last: u64,
    scene: Latest,
    /// By agent and field.
    grounds: BTreeMap<(usize, usize), Latest>,
    curve: Latest,
    frame: Latest,
    pages: usize,
    closed: bool,
}

impl State {
    fn next(&mut self, bytes: Vec<u8>) -> Latest {
        self.last += 1;
        Latest { number: self.last, bytes: Some(Arc::new(bytes)) }
    }

    /// Messages after a number, in the order in which a page needs them.
    fn after(&self, number: u64) -> Vec<Arc<Vec<u8>>> {
        let all = [&self.scene].into_iter().chain(self.grounds.values()).chain([&self.curve, &self.frame]);
        all.filter(|latest| latest.number > number).filter_map(|latest| latest.bytes.clone()).collect()
    }
}

#[derive(Default)]
pub struct Channel {
    state: Mutex<State>,
    changed: Condvar,
}

impl Channel {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Changes the state and wakes the pages.
    fn change(&self, change: impl FnOnce(&mut State)) {
        change(&mut self.state());
        self.changed.notify_all();
    }

    pub fn show(&self, scene: Vec<u8>) {
        self.change(|state| {
            state.scene = state.next(scene);
            state.grounds.clear();
            state.frame = Latest::default();
        });
    }

    pub fn frame(&self, frame: Vec<u8>) {
        self.change(|state| state.frame = state.next(frame));
    }

    pub fn ground(&self, place: (usize, usize), ground: Vec<u8>) {
        self.change(|state| {
            let latest = state.next(ground);
            state.grounds.insert(place, latest);
        });
    }

    pub fn curve(&self, curve: Vec<u8>) {
        self.change(|state| state.curve = state.next(curve));
    }

    pub fn is_watched(&self) -> bool {
        self.state().pages > 0
    }

    pub fn is_closed(&self) -> bool {
        self.state().closed
    }

    pub fn close(&self) {
        self.change(|state| state.closed = true);
    }

    /// Sends to a page until it goes away or the program ends.
    pub fn send(&self, page: &mut impl Write) -> Result<()> {
        self.change(|state| state.pages += 1);
        let sent = self.send_all(page);
        self.change(|state| state.pages -= 1);
        sent
    }

    fn send_all(&self, page: &mut impl Write) -> Result<()> {
        let mut number = 0;
        loop {
            let state = self.state();
            let waited = self.changed.wait_timeout_while(state, QUIET, |s| s.last == number && !s.closed);
            let (state, _) = waited.unwrap_or_else(PoisonError::into_inner);
            if state.closed {
                return Ok(());
            }
            let messages = state.after(number);
            number = state.last;
            drop(state);
            if messages.is_empty() {
                page.write_all(&message(ALIVE, &[]))?;
            }
            messages.iter().try_for_each(|bytes| page.write_all(bytes))?;
        }
    }
}
