//! The buffers between JavaScript and the module, and what a panic says.

use crate::answer::{Answer, Failure, Request};
use std::cell::RefCell;
use std::sync::{Mutex, PoisonError};

thread_local! {
    static INPUT: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
    static OUTPUT: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
}

/// Message of the panic that stopped the module.
static PANIC: Mutex<String> = Mutex::new(String::new());

/// Prepares the module. JavaScript calls it once, first.
#[unsafe(no_mangle)]
pub extern "C" fn start() {
    std::panic::set_hook(Box::new(|info| {
        *PANIC.lock().unwrap_or_else(PoisonError::into_inner) = info.to_string();
    }));
}

/// Whether the engine's fused products round once, as the module needs for its bits. Always true for the exact module.
#[unsafe(no_mangle)]
pub extern "C" fn fuses() -> bool {
    #[cfg(target_feature = "simd128")]
    return marathon_physics::lanes::fuses();
    #[cfg(not(target_feature = "simd128"))]
    true
}

/// Copies the message of the panic that stopped the module to the output buffer. The instance cannot be used afterward.
#[unsafe(no_mangle)]
pub extern "C" fn panicked() {
    let message = PANIC.lock().unwrap_or_else(PoisonError::into_inner).clone();
    OUTPUT.with_borrow_mut(|output| *output = message.into_bytes());
}

/// Makes room for a request of `length` bytes and returns its place.
#[unsafe(no_mangle)]
pub extern "C" fn input(length: usize) -> *mut u8 {
    INPUT.with_borrow_mut(|input| {
        input.clear();
        input.resize(length, 0);
        input.as_mut_ptr()
    })
}

/// Place of the last answer.
#[unsafe(no_mangle)]
pub extern "C" fn output() -> *const u8 {
    OUTPUT.with_borrow(|output| output.as_ptr())
}

/// Length of the last answer, bytes.
#[unsafe(no_mangle)]
pub extern "C" fn output_length() -> usize {
    OUTPUT.with_borrow(Vec::len)
}

/// Carries out the request in the input buffer, and puts the answer, or the message of the error, into the output buffer.
/// Returns the number of the object that the answer is about, or -1 after an error.
pub fn respond(work: impl FnOnce(Request) -> Result<Answer, Failure>) -> i32 {
    let input = INPUT.with_borrow_mut(std::mem::take);
    let (code, bytes) = match Request::parse(&input).and_then(work) {
        Ok(answer) => (answer.object, answer.bytes),
        Err(failure) => (-1, failure.to_json()),
    };
    OUTPUT.with_borrow_mut(|output| *output = bytes);
    code
}
