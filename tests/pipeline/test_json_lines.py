"""The lists beside a store."""

from __future__ import annotations

from pathlib import Path

from sonarsynth.store.files.json_lines import append_lines, read_lines


def test_lines_cut_off_by_a_crash_are_left_out(tmp_path: Path) -> None:
    file = tmp_path / "x.jsonl"
    assert read_lines(file) == []
    append_lines(file, [{"a": 1}, {"a": 2}])
    with file.open("a") as out:
        out.write('{"a": 3')
    assert read_lines(file) == [{"a": 1}, {"a": 2}]
