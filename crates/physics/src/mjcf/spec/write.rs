//! A document as text.

use super::super::document::Element;

/// MJCF of a document.
pub(super) fn text(root: &Element) -> String {
    let mut out = String::new();
    write(root, 0, &mut out);
    out
}

fn write(node: &Element, depth: usize, out: &mut String) {
    let indent = |out: &mut String| out.extend(std::iter::repeat_n("  ", depth));
    indent(out);
    out.push('<');
    out.push_str(&node.name);
    for attr in &node.attrs {
        out.push(' ');
        out.push_str(&attr.name);
        out.push_str("=\"");
        escape(&attr.value, out);
        out.push('"');
    }
    if node.children.is_empty() {
        out.push_str("/>\n");
        return;
    }
    out.push_str(">\n");
    node.children.iter().for_each(|child| write(child, depth + 1, out));
    indent(out);
    out.push_str("</");
    out.push_str(&node.name);
    out.push_str(">\n");
}

/// An attribute's value. Line breaks and tabs are written so that a reader does not turn them into spaces.
fn escape(value: &str, out: &mut String) {
    for c in value.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\n' => out.push_str("&#10;"),
            '\r' => out.push_str("&#13;"),
            '\t' => out.push_str("&#9;"),
            c => out.push(c),
        }
    }
}
