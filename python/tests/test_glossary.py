"""The glossary has a row for every public word, and no other."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_every_public_word_has_a_row_in_the_glossary(tmp_path: Path) -> None:
    # the console script, as pip makes it
    program = tmp_path / "marathon"
    program.write_text(f"#!{sys.executable}\nfrom marathon_rl._command import main\n\nmain()\n")
    program.chmod(0o755)
    words = [sys.executable, ROOT / "docs/glossary.py", "--program", program, "--check"]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
