//! The saved state of a learner, by name.

use crate::error::Error;
use crate::optim::adam::Adam;

/// The state that a learner needs to resume.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Saved {
    /// Single numbers.
    pub scalars: Vec<(String, f64)>,
    /// Lists.
    pub lists: Vec<(String, Numbers)>,
}

/// A list of numbers.
#[derive(Clone, Debug, PartialEq)]
pub enum Numbers {
    /// Single precision.
    F32(Vec<f32>),
    /// Double precision.
    F64(Vec<f64>),
    /// 32-bit words.
    U32(Vec<u32>),
    /// 64-bit words.
    U64(Vec<u64>),
}

impl Numbers {
    fn len(&self) -> usize {
        match self {
            Numbers::F32(x) => x.len(),
            Numbers::F64(x) => x.len(),
            Numbers::U32(x) => x.len(),
            Numbers::U64(x) => x.len(),
        }
    }
}

macro_rules! numbers {
    ($($t:ty, $kind:ident);*) => {$(
        impl From<&[$t]> for Numbers {
            fn from(list: &[$t]) -> Self {
                Numbers::$kind(list.to_vec())
            }
        }
        impl<'a> TryFrom<&'a Numbers> for &'a [$t] {
            type Error = ();
            fn try_from(numbers: &'a Numbers) -> Result<Self, ()> {
                if let Numbers::$kind(list) = numbers { Ok(list) } else { Err(()) }
            }
        }
    )*};
}
numbers!(f32, F32; f64, F64; u32, U32; u64, U64);

impl Saved {
    /// Adds a list.
    pub fn list<'l, N>(&mut self, name: &str, list: &'l [N])
    where
        Numbers: From<&'l [N]>,
    {
        self.lists.push((name.into(), list.into()));
    }
    /// Adds a number.
    pub fn scalar(&mut self, name: &str, x: f64) {
        self.scalars.push((name.into(), x));
    }
    /// Copies a list of known length.
    ///
    /// # Errors
    /// If the list is missing or has another length.
    pub fn copy<'s, N: Copy + 'static>(&'s self, name: &str, to: &mut [N]) -> Result<(), Error>
    where
        &'s [N]: TryFrom<&'s Numbers>,
    {
        let list = self.get::<N>(name)?;
        if list.len() != to.len() {
            return Err(Error::Mismatch {
                what: format!("checkpoint: {name}"),
                found: format!("{} numbers", list.len()),
                expected: to.len().to_string(),
            });
        }
        to.copy_from_slice(list);
        Ok(())
    }
    /// Returns a list of any length.
    ///
    /// # Errors
    /// If the list is missing.
    pub fn get<'s, N: 'static>(&'s self, name: &str) -> Result<&'s [N], Error>
    where
        &'s [N]: TryFrom<&'s Numbers>,
    {
        let list = self.lists.iter().find(|(n, _)| n == name);
        list.and_then(|(_, list)| list.try_into().ok()).ok_or_else(|| Error::Mismatch {
            what: format!("checkpoint: {name}"),
            found: list.map_or("none".into(), |(_, list)| format!("{} other numbers", list.len())),
            expected: "those of the algorithm".into(),
        })
    }
    /// Returns a single number.
    ///
    /// # Errors
    /// If the number is missing.
    pub fn number(&self, name: &str) -> Result<f64, Error> {
        self.scalars.iter().find(|(n, _)| n == name).map(|(_, x)| *x).ok_or_else(|| Error::Mismatch {
            what: format!("checkpoint: {name}"),
            found: "none".into(),
            expected: "that of the algorithm".into(),
        })
    }
}

/// Saves the state of Adam.
pub(crate) fn save_adam(adam: &Adam, saved: &mut Saved) {
    saved.list("adam_m", &adam.m);
    saved.list("adam_v", &adam.v);
    saved.scalar("adam_power_1", adam.powers[0]);
    saved.scalar("adam_power_2", adam.powers[1]);
}

/// The inverse of [`save_adam`].
pub(crate) fn load_adam(adam: &mut Adam, saved: &Saved) -> Result<(), Error> {
    saved.copy("adam_m", &mut adam.m)?;
    saved.copy("adam_v", &mut adam.v)?;
    adam.powers = [saved.number("adam_power_1")?, saved.number("adam_power_2")?];
    Ok(())
}
