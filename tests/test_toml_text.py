"""The line on which something of a robot file stands."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tautwire.toml_text import line_of_key

TEXT = '''\
# a comment
name = """
two
lines"""

[platform]
start = [
    1.0,  # mass = 3
    2.0,
]
"quoted key" = 1
inner.deep = 2

[[cable]]
law = "a"

  [[cable]]
  law = "b"
list = [{a = 1}, {a = 2}]
'''


@pytest.mark.parametrize(
    ("place", "line"),
    [
        (("name",), 2),
        (("platform",), 6),
        (("platform", "start"), 7),
        (("platform", "start", 1), 7),
        (("platform", "quoted key"), 11),
        (("platform", "inner", "deep"), 12),
        (("cable", 0, "law"), 15),
        (("cable", 1), 17),
        (("cable", 1, "law"), 18),
        (("cable", 1, "list", 1, "a"), 19),
        (("cable", 1, "missing"), 17),
        (("cable", 7, "law"), 14),
        (("missing",), None),
        ((), None),
    ],
)
def test_a_place_has_the_line_of_its_statement(place: tuple[str | int, ...], line: int | None) -> None:
    assert line_of_key(TEXT, place) == line


@given(blank=st.lists(st.integers(0, 3), min_size=5, max_size=5))
def test_blank_lines_and_comments_are_counted(blank: list[int]) -> None:
    lines: list[str] = []
    places = []
    for number, count in enumerate(blank):
        lines += ["# comment"] * count + [""] * count + [f"key_{number} = {number}"]
        places.append(len(lines))
    assert [line_of_key("\n".join(lines), (f"key_{number}",)) for number in range(5)] == places
