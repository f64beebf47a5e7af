"""The bar chart of the README, from its table of physics steps."""

import re
from pathlib import Path

ROW = re.compile(r"^\| \[(\w+)\]\([^)]*\) \| ([\d,]+) ns \| ([\d,]+) ns \| (\d+) \|", re.MULTILINE)
WIDTH, BAR, GAP, LEFT = 860, 14, 18, 110
ROOM = 610
"""Length of the longest bar."""
STYLE = """\
text { font: 14px system-ui, "Segoe UI", Helvetica, Arial, sans-serif; fill: #1f2328 }
.note { font-size: 12.5px; fill: #59636e }
.peer { fill: #8c959f }
.ours { fill: #0969da }
@media (prefers-color-scheme: dark) {
  text { fill: #e6edf3 }
  .note { fill: #9198a1 }
  .ours { fill: #58a6ff }
}"""


def rows(readme: Path) -> list[tuple[str, int, int, int]]:
    """Task, nanoseconds of MuJoCo, nanoseconds of Marathon, and ratio of each row."""
    found = ROW.findall(readme.read_text("utf-8"))
    if not found:
        raise ValueError(f"{readme} has no table of physics steps")
    return [(task, int(a.replace(",", "")), int(b.replace(",", "")), int(ratio)) for task, a, b, ratio in found]


def svg(readme: Path) -> str:
    """Draw the chart."""
    table = rows(readme)
    longest = max(peer for _, peer, _, _ in table)
    parts, y = [], 58
    for task, peer, ours, ratio in table:
        lengths = [ROOM * time / longest for time in (peer, ours)]
        parts += [
            f'<text x="{LEFT - 12}" y="{y + BAR + 5}" text-anchor="end">{task}</text>',
            f'<rect class="peer" x="{LEFT}" y="{y}" width="{lengths[0]:.1f}" height="{BAR}"/>',
            f'<text class="note" x="{LEFT + lengths[0] + 8:.1f}" y="{y + BAR - 3}">MuJoCo {peer:,} ns</text>',
            f'<rect class="ours" x="{LEFT}" y="{y + BAR + 1}" width="{lengths[1]:.1f}" height="{BAR}"/>',
            f'<text class="note" x="{LEFT + lengths[1] + 8:.1f}" y="{y + 2 * BAR - 2}">'
            f"Marathon {ours:,} ns, {ratio} times as fast</text>",
        ]
        y += 2 * BAR + GAP
    head = [
        f'<text x="{LEFT}" y="22">Time of one physics step of one agent on one core; shorter is better</text>',
        f'<text class="note" x="{LEFT}" y="42">AMD EPYC with AVX-512. MuJoCo 4.0.0 in double precision, Marathon in '
        "single precision, 16 agents per core at once.</text>",
    ]
    size = f'width="{WIDTH}" height="{y}" viewBox="0 0 {WIDTH} {y}"'
    body = "\n".join([*head, *parts])
    return f'<svg xmlns="http://www.w3.org/2000/svg" {size} role="img">\n<style>\n{STYLE}\n</style>\n{body}\n</svg>\n'
