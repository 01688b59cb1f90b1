"""The Python in the pages under docs/ runs as it stands."""

import re
from pathlib import Path

import pytest

DOCS = Path(__file__).parent.parent / "docs"


@pytest.mark.slow
def test_example_of_the_controllers_page_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    page = (DOCS / "control.md").read_text(encoding="utf-8")
    (example,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    found: dict[str, object] = {}
    exec(compile(example, "control.md", "exec"), found)
    difference = found["motion"].position - found["same"].position  # type: ignore[attr-defined]
    assert abs(difference).max() < 1e-9
