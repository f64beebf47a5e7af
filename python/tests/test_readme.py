"""The README's Python example runs as printed."""

import os
import re
from pathlib import Path

import pytest

README = Path(__file__).parents[2] / "README.md"


def blocks() -> list[str]:
    return re.findall(r"^```python\n(.*?)^```$", README.read_text(), flags=re.DOTALL | re.MULTILINE)


def test_the_readme_has_an_example() -> None:
    assert len(blocks()) == 1


@pytest.mark.skipif("MARATHON_TEST_EMULATED" in os.environ, reason="an emulator takes half an hour for its training")
@pytest.mark.parametrize("code", blocks())
def test_the_example_trains_plays_and_exports(
    code: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    exec(compile(code, "README.md", "exec"), {"__name__": "__main__"})
    numbers = [float(number) for number in re.findall(r"return of .*?: (\S+)", capsys.readouterr().out)]
    assert len(numbers) == 2
    assert min(numbers) > 700
    assert (tmp_path / "runs/readme/policy.safetensors").is_file()
    assert (tmp_path / "hopper.onnx").is_file()
