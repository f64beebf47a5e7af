//! The objects that JavaScript holds, by number.

use crate::abi::respond;
use crate::answer::{Answer, Failure, Request};
use std::any::Any;
use std::cell::RefCell;

/// A kind of object.
pub trait Kind: Any {
    /// Its name in messages.
    const NAME: &'static str;
}

thread_local!(static OBJECTS: RefCell<Vec<Option<Box<dyn Any>>>> = const { RefCell::new(Vec::new()) });

/// Keeps an object and returns its number.
pub fn keep(object: impl Kind) -> usize {
    OBJECTS.with_borrow_mut(|objects| {
        let place = objects.iter().position(Option::is_none).unwrap_or_else(|| {
            objects.push(None);
            objects.len() - 1
        });
        objects[place] = Some(Box::new(object));
        place
    })
}

/// Runs a function with an object.
pub fn with<K: Kind, R>(number: usize, work: impl FnOnce(&mut K) -> Result<R, Failure>) -> Result<R, Failure> {
    OBJECTS.with_borrow_mut(|objects| {
        let found = objects.get_mut(number).and_then(Option::as_mut).and_then(|object| object.downcast_mut::<K>());
        work(found.ok_or_else(|| Failure::from(format!("this {} has been freed", K::NAME)))?)
    })
}

/// Carries out a request about an object, see [`respond`].
pub fn ask<K: Kind>(number: usize, work: impl FnOnce(&mut K, Request) -> Result<Answer, Failure>) -> i32 {
    respond(|request| with::<K, _>(number, |object| work(object, request)))
}

/// Frees an object.
#[unsafe(no_mangle)]
pub extern "C" fn free_object(number: usize) {
    // dropped after the borrow has ended
    let object = OBJECTS.with_borrow_mut(|objects| objects.get_mut(number).and_then(Option::take));
    drop(object);
}
