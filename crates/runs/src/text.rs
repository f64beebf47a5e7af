//! Formatting of numbers and paths.

use marathon_learn::Ancestor;
use serde::Serializer;
use std::borrow::Cow;
use std::path::{Component, Path, PathBuf};

/// `12345678` as `12,345,678`.
pub fn thousands(n: u64) -> String {
    let digits = n.to_string();
    let mut out = String::with_capacity(digits.len() + digits.len() / 3);
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push(',');
        }
        out.push(digit);
    }
    out
}

/// `Hopper-v0` as `hopper`: the bare name means the first version.
pub fn short_name(agent: &str) -> String {
    let name = agent.to_lowercase();
    name.strip_suffix("-v0").unwrap_or(&name).to_string()
}

/// A number with `k` for thousands or `M` for millions: `512 k`, `1.25 M`.
pub fn short(x: f64) -> String {
    match x {
        x if x >= 9.995e8 => format!("{:.2} G", x / 1e9),
        x if x >= 9.995e5 => format!("{:.2} M", x / 1e6),
        x if x >= 9.995e4 => format!("{:.0} k", x / 1e3),
        x if x >= 9.995e2 => format!("{:.1} k", x / 1e3),
        x => format!("{x:.0}"),
    }
}

/// A number of things: `1 agent`, `12,288 agents`.
pub fn counted(n: usize, noun: &str) -> String {
    format!("{} {noun}{}", thousands(n as u64), if n == 1 { "" } else { "s" })
}

/// Seconds as `8.3 s`, `2 min 05 s` or `1 h 02 min`.
pub fn duration(seconds: f64) -> String {
    let whole = seconds.round() as u64;
    match whole {
        0..60 => format!("{seconds:.1} s"),
        60..3600 => format!("{} min {:02} s", whole / 60, whole % 60),
        _ => format!("{} h {:02} min", whole / 3600, whole % 3600 / 60),
    }
}

/// A stage that a policy comes from: `steady: train WalkerController-v0, seed 2, 40,000,000 steps, from follows`.
pub fn ancestor(of: &Ancestor) -> String {
    let Ancestor { stage, kind, agent, seed, steps, from, .. } = of;
    let seed = seed.map_or(String::new(), |seed| format!(", seed {seed}"));
    let steps = if *steps == 0 { String::new() } else { format!(", {} steps", thousands(*steps)) };
    let from = if from.is_empty() { String::new() } else { format!(", from {}", from.join(", ")) };
    format!("{stage}: {kind} {agent}{seed}{steps}{from}")
}

/// A note on agents whose state became non-finite. `None` if there were none.
pub fn broken(agents: u64) -> Option<String> {
    let times = match agents {
        0 => return None,
        1 => "once".into(),
        n => format!("{} times", thousands(n)),
    };
    Some(format!("note: {times} the simulation of an agent broke down (its state was not finite)"))
}

/// A note on skipped minibatches. `None` if there were none.
pub fn skipped(minibatches: u64) -> Option<String> {
    let were = match minibatches {
        0 => return None,
        1 => "1 minibatch was".into(),
        n => format!("{} minibatches were", thousands(n)),
    };
    Some(format!("note: {were} left out because the gradient was not finite; a smaller learning rate or network helps"))
}

/// Zero for a number that would be formatted as `-0.0` with this number of decimals.
pub fn unsigned_zero(x: f64, decimals: i32) -> f64 {
    if x.abs() < 0.5 * 10_f64.powi(-decimals) { 0.0 } else { x }
}

/// Whether a character can control a terminal: control characters except tabs and line ends, and marks that change the
/// text direction.
fn commands_terminals(c: char) -> bool {
    let turns = matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    turns || (c.is_control() && !matches!(c, '\n' | '\t'))
}

/// Makes a text from a file safe for a terminal: escapes characters that can control the terminal, for example as
/// `\u{1b}`.
pub fn printable(text: &str) -> Cow<'_, str> {
    replaced(text, |c| c.escape_unicode().to_string())
}

/// Makes JSON safe for a terminal: escapes characters that can control the terminal, which does not change its meaning.
pub fn printable_json(json: &str) -> Cow<'_, str> {
    replaced(json, |c| format!("\\u{:04x}", u32::from(c)))
}

fn replaced(text: &str, escape: impl Fn(char) -> String) -> Cow<'_, str> {
    if !text.contains(commands_terminals) {
        return text.into();
    }
    text.chars().map(|c| if commands_terminals(c) { escape(c) } else { c.to_string() }).collect::<String>().into()
}

/// Serializes a path as JSON text. Bytes that are not UTF-8 become replacement characters.
pub fn path_json<S: Serializer>(path: &Path, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&path.to_string_lossy())
}

/// Makes a path absolute. A path that is not UTF-8 stays as it is, because `run.json` cannot store it.
pub fn whole(path: &Path) -> PathBuf {
    std::path::absolute(path).ok().filter(|whole| whole.to_str().is_some()).unwrap_or_else(|| path.into())
}

/// A path as a word of a shell command.
pub fn path_word(path: &Path) -> String {
    match path.to_str() {
        Some(text) => word(text),
        None => {
            // bash, zsh and others read escapes in such quotes
            let escaped = path.as_os_str().as_encoded_bytes().iter().map(|byte| match byte {
                b'\'' | b'\\' => format!("\\{}", char::from(*byte)),
                b' '..=b'~' => char::from(*byte).to_string(),
                other => format!("\\x{other:02x}"),
            });
            format!("$'{}'", escaped.collect::<String>())
        }
    }
}

/// A text as a word of a shell command.
pub fn word(text: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "/\\._-+:~=,".contains(c);
    if !text.is_empty() && text.chars().all(plain) { text.into() } else { format!("'{}'", text.replace('\'', r"'\''")) }
}

/// Whether two paths have the same names, apart from `.`.
fn is_same(a: &Path, b: &Path) -> bool {
    fn names(path: &Path) -> impl Iterator<Item = Component<'_>> {
        path.components().filter(|part| *part != Component::CurDir)
    }
    names(a).eq(names(b))
}

/// A path with a similar name to `path`, next to it or in one of these folders, that satisfies `fits`.
pub fn nearest_path(path: &Path, folders: &[&Path], fits: impl Fn(&Path) -> bool) -> Option<String> {
    let asked = path.display().to_string();
    let parent = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut near: Vec<(usize, String)> = Vec::new();
    for folder in [parent].iter().chain(folders) {
        for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
            let other = entry.path();
            // the path itself is no correction of it
            if !is_same(&other, path) && fits(&other) {
                let name = other.display().to_string();
                let name = name.strip_prefix("./").unwrap_or(&name).to_string();
                near.push((strsim::damerau_levenshtein(&asked, &name), name));
            }
        }
    }
    near.sort();
    let close = near.into_iter().next().filter(|(distance, name)| *distance <= 3 || name.ends_with(&asked));
    close.map(|(_, name)| name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_well() {
        assert_eq!([0, 999, 1000, 1234567].map(thousands), ["0", "999", "1,000", "1,234,567"]);
        assert_eq!([12.0, 1500.0, 512_345.0, 1.25e6].map(short), ["12", "1.5 k", "512 k", "1.25 M"]);
        assert_eq!([8.31, 59.96, 125.0, 3725.0].map(duration), ["8.3 s", "1 min 00 s", "2 min 05 s", "1 h 02 min"]);
    }

    #[test]
    fn what_commands_a_terminal_is_shown() {
        assert_eq!(printable("a\tb\n\u{b1}\u{1f600}"), "a\tb\n\u{b1}\u{1f600}");
        assert_eq!(printable("\u{1b}[2J\r\u{9b}1m\u{202e}"), r"\u{1b}[2J\u{d}\u{9b}1m\u{202e}");
        let json = serde_json::to_string("\u{9b}\u{7f}\u{1b}").unwrap();
        let shown = printable_json(&json);
        assert_eq!(shown, r#""\u009b\u007f\u001b""#);
        assert_eq!(serde_json::from_str::<String>(&shown).unwrap(), "\u{9b}\u{7f}\u{1b}");
    }

    #[test]
    fn breakdowns_are_told() {
        assert_eq!(broken(0), None);
        assert!(broken(1).unwrap().contains("once") && broken(1234).unwrap().contains("1,234 times"));
    }

    #[test]
    fn odd_paths_are_quoted() {
        assert_eq!(path_word(Path::new("runs/hopper-1")), "runs/hopper-1");
        assert_eq!(path_word(Path::new("my runs/a")), "'my runs/a'");
        assert_eq!(path_word(Path::new("it's")), r"'it'\''s'");
        #[cfg(unix)]
        {
            use std::os::unix::ffi::OsStrExt;
            let odd = std::ffi::OsStr::from_bytes(b"it's \xff");
            assert_eq!(path_word(Path::new(odd)), r"$'it\'s \xff'");
        }
    }
}
