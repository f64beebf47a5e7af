//! Text that MuJoCo's XML parser takes although it is not well-formed XML, made well-formed where it has only one meaning.
//!
//! | text | meaning |
//! |---|---|
//! | `--` in a comment | part of the comment |
//! | `<!- ... >`, `<!DOCTYPE mujoco>` | nothing |
//! | `name="a"type="box"` | two attributes |
//! | `</mujoco>` once more at the end | nothing |
//!
//! Lines stay as they are. Everything else is left to the parser, which refuses it.

use std::borrow::Cow;
use std::ops::Range;

/// Limit on the attributes of an element. The parser compares each with all others.
pub(super) const MAX_ATTRIBUTES: usize = 500;

/// Parts that the parser reads as one piece.
const OPAQUE: [(&str, &str); 2] = [("<![CDATA[", "]]>"), ("<?", "?>")];

/// The text as well-formed XML, or the line of the first start tag with too many attributes.
pub(super) fn repaired(text: &str) -> Result<Cow<'_, str>, usize> {
    let mut repairs = Repairs { text, changes: Vec::new() };
    let (mut at, mut open, mut closed) = (0, 0usize, false);
    while let Some(start) = text[at..].find('<').map(|i| at + i) {
        let rest = &text[start..];
        at = if rest.starts_with("<!--") {
            repairs.comment(start)
        } else if let Some((_, end)) = OPAQUE.iter().find(|(begin, _)| rest.starts_with(begin)) {
            behind(text, start, end)
        } else if rest.starts_with("<!") {
            repairs.declaration(start)
        } else if rest.starts_with("</") {
            let end = behind(text, start, ">");
            if closed {
                if are_end_tags(&text[start..]) {
                    repairs.blank(start..text.len());
                }
                break;
            }
            open = open.saturating_sub(1);
            closed |= open == 0;
            end
        } else {
            let end = repairs.start_tag(start).ok_or_else(|| line(text, start))?;
            if text[..end].ends_with("/>") {
                closed |= open == 0;
            } else {
                open += 1;
            }
            end
        };
    }
    Ok(repairs.applied())
}

/// The place behind the next `end`.
fn behind(text: &str, from: usize, end: &str) -> usize {
    text[from..].find(end).map_or(text.len(), |i| from + i + end.len())
}

/// Whether a text consists of end tags.
fn are_end_tags(text: &str) -> bool {
    let is_open_end_tag = |tag: &str| tag.trim_ascii().strip_prefix("</").is_some_and(|name| !name.contains('<'));
    match text.trim_ascii_end().strip_suffix('>') {
        Some(tags) => tags.split('>').all(is_open_end_tag),
        None => false,
    }
}

fn line(text: &str, at: usize) -> usize {
    1 + text.bytes().take(at).filter(|b| *b == b'\n').count()
}

/// Changes of a text, in order.
struct Repairs<'t> {
    text: &'t str,
    changes: Vec<(Range<usize>, String)>,
}

impl<'t> Repairs<'t> {
    /// Puts spaces in place of everything but line breaks.
    fn blank(&mut self, range: Range<usize>) {
        let spaces = self.text[range.clone()].chars().map(|c| if c == '\n' { '\n' } else { ' ' }).collect();
        self.changes.push((range, spaces));
    }

    /// Removes dashes from a comment that has two of them in a row. Returns the place behind it.
    fn comment(&mut self, start: usize) -> usize {
        let start = start + "<!--".len();
        let end = self.text[start..].find("-->").map_or(self.text.len(), |i| start + i);
        let inside = &self.text[start..end];
        if inside.contains("--") || inside.ends_with('-') {
            self.changes.push((start..end, inside.replace('-', " ")));
        }
        end
    }

    /// Removes a declaration. One with a part in brackets or angle brackets stays, because it may end elsewhere.
    fn declaration(&mut self, start: usize) -> usize {
        let end = behind(self.text, start, ">");
        let inside = &self.text[start + 1..end];
        if inside.ends_with('>') && !inside.contains(['<', '[']) {
            self.blank(start..end);
        }
        end
    }

    /// Separates the attributes of a start tag. Returns the place behind it, or nothing if there are too many.
    fn start_tag(&mut self, start: usize) -> Option<usize> {
        let bytes = self.text.as_bytes();
        let (mut at, mut values) = (start + 1, 0);
        while let Some(&byte) = bytes.get(at) {
            at += 1;
            match byte {
                b'>' => break,
                b'"' | b'\'' => {
                    values += 1;
                    at = bytes[at..].iter().position(|b| *b == byte).map_or(bytes.len(), |i| at + i + 1);
                    if bytes.get(at).is_some_and(u8::is_ascii_alphabetic) {
                        self.changes.push((at..at, " ".to_owned()));
                    }
                }
                _ => {}
            }
        }
        (values <= MAX_ATTRIBUTES).then_some(at)
    }

    fn applied(self) -> Cow<'t, str> {
        if self.changes.is_empty() {
            return self.text.into();
        }
        let (mut out, mut at) = (String::with_capacity(self.text.len() + self.changes.len()), 0);
        for (range, new) in self.changes {
            out.push_str(&self.text[at..range.start]);
            out.push_str(&new);
            at = range.end;
        }
        out.push_str(&self.text[at..]);
        out.into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_with_one_meaning_becomes_well_formed() {
        for (text, expected) in [
            ("<a><!-- x -- y\n-z- --></a>", "<a><!-- x    y\n z  --></a>"),
            ("<a><!-\\- x\n -\\-><b/></a>", "<a>       \n     <b/></a>"),
            ("<!DOCTYPE mujoco><a/>", "                 <a/>"),
            ("<a b=\"1\"c='2'/>", "<a b=\"1\" c='2'/>"),
            ("<a>\n</a>\n</a>\n", "<a>\n</a>\n    \n"),
            ("<a/></b> </c>\n</d>", "<a/>         \n    "),
        ] {
            assert_eq!(repaired(text).as_deref(), Ok(expected));
            assert!(roxmltree::Document::parse(expected).is_ok(), "{expected}");
        }
    }

    #[test]
    fn other_text_stays() {
        for text in [
            "<a b=\"<!- >\" c='</a>'><![CDATA[ <!- > </a> ]]></a>",
            "<?xml version=\"1.0\"?><a/>",
            "<!DOCTYPE a [<!ENTITY b \"c\">]><a/>",
            "<a/></a> text",
            "<a/></a>text</a>",
            "<a/></a><b/></a>",
            "<a></a><a/>",
            "<a>\"b\"c</a>",
            "<a b=\"",
            "<a",
            "<!-- a",
            "<!",
            "é<é é=\"é\"é='é'/>",
        ] {
            assert_eq!(repaired(text).as_deref(), Ok(text));
        }
        let crowded = format!("<a/>\n<b {}/>", "c='1' ".repeat(501));
        assert_eq!(repaired(&crowded), Err(2));
    }
}
