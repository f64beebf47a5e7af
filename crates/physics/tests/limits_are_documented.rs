//! The page `docs/reference/limits.md` lists every limit of the budget with its default, and no others.

use marathon_physics::budget;

#[test]
fn the_page_of_limits_has_a_row_for_each_limit() {
    let page = include_str!("../../../docs/reference/limits.md");
    let table = page.split("## The budget").nth(1).and_then(|rest| rest.split("\n## ").next()).expect("a section");
    let rows: Vec<&str> = table.lines().filter(|line| line.starts_with("| `")).collect();
    let expected: Vec<String> = budget::ALL
        .iter()
        .map(|limit| format!("| `{}` | {} | {} |", limit.name, limit.default_text(), limit.what))
        .collect();
    assert_eq!(rows, expected, "docs/reference/limits.md should have these rows:\n{}", expected.join("\n"));
}
