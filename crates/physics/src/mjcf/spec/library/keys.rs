//! Keyframes of attached models. Their numbers stay with the joints, mocap bodies and actuators until the whole model is known.

use super::super::super::document::{Element, KeyNumbers, LISTS, Place};
use super::super::super::error::MjcfError;
use super::super::super::room::Room;
use super::super::super::settings::entries;
use super::super::super::value::numbers;
use super::super::keyframes::{self, Values};
use super::super::part::{Draft, set};
use super::super::walk::{self, Path};

/// A keyframe without its numbers.
#[derive(Clone, Debug)]
pub(in super::super) struct Key {
    pub name: String,
    /// It is one of the model itself, not of a model that is attached to it.
    pub own: bool,
    time: Option<String>,
    /// Which lists it has.
    lists: [bool; LISTS.len()],
    place: Place,
}

impl Key {
    /// The keyframe in a model that attaches this one. Keyframes of models that this one attaches keep their names, as in MuJoCo.
    pub(in super::super) fn attached(&self, prefix: &str) -> Key {
        let name = if self.own { format!("{prefix}{}", self.name) } else { self.name.clone() };
        Key { name, own: false, ..self.clone() }
    }
}

/// Moves the numbers of a model's keyframes to its elements.
pub(in super::super) fn keep(root: &mut Element, room: &Room) -> Result<Vec<Key>, MjcfError> {
    let mut keys = Vec::new();
    if entries(root, "keyframe").next().is_none() {
        return Ok(keys);
    }
    let rest = keyframes::at_rest(root, room)?;
    let mut found: Vec<(Path, KeyNumbers)> = Vec::new();
    for element in entries(root, "keyframe") {
        let name = element.text("name").unwrap_or_default().to_owned();
        let mut given: [Vec<f64>; LISTS.len()] = Default::default();
        for (i, list) in LISTS.into_iter().enumerate() {
            let most = rest.iter().map(|(_, values)| values[i].len()).sum();
            if let Some(attr) = element.attr(list) {
                given[i] = numbers(element, attr, 0, most)?;
            }
        }
        room.take_for(element, rest.len(), 300 + name.len())?;
        let mut starts = [0; LISTS.len()];
        for (path, values) in &rest {
            let lists = std::array::from_fn(|i| part(&given[i], &mut starts[i], &values[i]));
            found.push((path.clone(), KeyNumbers { key: name.clone(), own: true, lists }));
        }
        let time = element.text("time").map(str::to_owned);
        let lists = std::array::from_fn(|i| !given[i].is_empty());
        keys.push(Key { name, own: true, time, lists, place: element.place.clone() });
    }
    for (path, numbers) in found {
        walk::at_mut(root, &path).keys.push(numbers);
    }
    root.children.retain(|section| section.name != "keyframe");
    Ok(keys)
}

/// Gives the numbers of the model's own keyframes the names that these have where the model is attached. As in MuJoCo, all elements
/// keep them until they are copied.
pub(in super::super) fn store(element: &mut Element, prefix: &str, room: &Room) -> Result<(), MjcfError> {
    let own: Vec<KeyNumbers> = element.keys.iter().filter(|numbers| numbers.own).cloned().collect();
    for numbers in own {
        let key = format!("{prefix}{}", numbers.key);
        room.take_for(element, 1, 300 + key.len())?;
        element.keys.push(KeyNumbers { key, own: false, ..numbers });
    }
    element.children.iter_mut().try_for_each(|child| store(child, prefix, room))
}

/// Removes the numbers from an element and all that it holds, but for those of the model's own keyframes.
pub(in super::super) fn forget(element: &mut Element) {
    element.keys.retain(|numbers| numbers.own);
    element.children.iter_mut().for_each(forget);
}

/// The next numbers of a list. The rest of a short list is at rest.
fn part(given: &[f64], start: &mut usize, rest: &[f64]) -> Vec<f64> {
    let numbers = (0..rest.len()).map(|i| given.get(*start + i).copied().unwrap_or(rest[i])).collect();
    *start += rest.len();
    numbers
}

/// Writes keyframes whose numbers are in the elements. All else is at rest in them.
pub(in super::super) fn write(root: &mut Element, keys: &[Key], room: &Room) -> Result<(), MjcfError> {
    if keys.is_empty() {
        return Ok(());
    }
    let rest = keyframes::at_rest(root, room)?;
    let mut elements = Vec::new();
    for key in keys {
        let mut element = Draft::new("key").placed(&key.place);
        if !key.name.is_empty() {
            set(&mut element, "name", key.name.as_str().into());
        }
        if let Some(time) = &key.time {
            set(&mut element, "time", time.as_str().into());
        }
        room.take_for(&element, rest.len(), 100)?;
        for (i, list) in LISTS.into_iter().enumerate().filter(|(i, _)| key.lists[*i]) {
            let numbers: Vec<f64> = rest
                .iter()
                .flat_map(|(path, values)| numbers_in(walk::at(root, path), key, i, values))
                .copied()
                .collect();
            if !numbers.is_empty() {
                set(&mut element, list, numbers.as_slice().into());
            }
        }
        elements.push(element);
    }
    let last = super::super::last_section(root, "keyframe");
    root.children[last].children.extend(elements);
    rest.iter().for_each(|(path, _)| walk::at_mut(root, path).keys.clear());
    Ok(())
}

/// An element's numbers in a list of a key.
fn numbers_in<'e>(element: &'e Element, key: &Key, list: usize, rest: &'e Values) -> &'e [f64] {
    let own = element
        .keys
        .iter()
        .rfind(|numbers| !numbers.own && numbers.key == key.name)
        .map(|numbers| &numbers.lists[list]);
    own.filter(|own| own.len() == rest[list].len()).unwrap_or(&rest[list])
}
