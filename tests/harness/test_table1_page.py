"""Table 1 as it is written: figures by hand, Markdown, JSON, and a page that opens from disk."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import pytest
from test_report import a_result, save_run
from test_table1 import Record, names, record

from validation.jobs.code import fingerprint
from validation.jobs.store import Ended
from validation.report import write, write_table1
from validation.studies import published
from validation.studies import table1 as table

MADE = {
    **{"date": "2026-11-22T17:00:00+00:00", "commit": "abc1234", "cpus": 2, "machine": "x86_64"},
    "versions": {"lightloc": "0.1.0", "python": "3.11.7"},
}
HOSTILE = "</script><script>alert('x')</script> <b>"


def ended(name: str, result: Record | None, error: str = "") -> Ended:
    return Ended(name, fingerprint(), 1.0, asdict(result) if result else None, error)


def by_name(scenes: Sequence[Ended]) -> dict[str, Ended]:
    return {scene.name: scene for scene in scenes}


def test_figures_of_a_row():
    """Shares over all ended scenes, the crashed among them; runtimes over those that have one.

    By hand: 4 scenes, one crashed, 2 solved: 2/4; times 1, 2, 6: median 2, longest 6.
    """
    scenes = [
        ended("noisy-2-000", record("noisy-2-000", seconds=1.0)),
        ended("noisy-2-001", record("noisy-2-001", seconds=6.0)),
        ended("noisy-2-002", record("noisy-2-002", solved=False, seconds=2.0)),
        ended("noisy-2-003", None, "ValueError: no"),
    ]
    (row,) = table.tabulate(names(5), by_name(scenes))
    assert (row.planned, row.ended, row.crashed) == (5, 4, 1)
    texts = {cell.column: cell.text for cell in row.cells}
    assert texts == {
        **{"Random": "0.38 (0.80)", "Full": "0.75 (0.99)", "Solved": "0.50 (0.78)"},
        **{"Median (s)": "2.0 (2)", "Max (s)": "6.0 (52)"},
    }
    assert [cell.column for cell in row.below] == ["Full", "Solved"]
    said = table.verdict([row])
    assert "Below the paper: noisy-2 Full 0.75 (0.99), noisy-2 Solved 0.50 (0.78)." in said
    assert "1 of 4 scenes crashed." in said and "4 of 5 scenes have been run." in said
    assert said.endswith("A row has 5 scenes here, the paper's 100.")


@pytest.mark.parametrize(("solved", "met"), [(38, True), (37, False)])
def test_the_goal_is_the_papers_figure(solved, met):
    """0.38 of 100 five-light scenes under noise reaches the paper's 0.38; one fewer does not."""
    every = names(100, "noisy-5")
    scenes = [ended(name, record(name, i < solved)) for i, name in enumerate(every)]
    (row,) = table.tabulate(every, by_name(scenes))
    cells = {cell.column: cell for cell in row.cells}
    assert cells["Solved"].met is met
    assert cells["Full"].met is True
    assert cells["Random"].met is None


def test_a_row_without_scenes_has_no_figures_of_ours():
    rows = table.tabulate(names(2, "noisy-2", "noisy-3"), by_name([]))
    assert [row.cells[0].text for row in rows] == ["– (0.80)", "– (0.53)"]
    assert all(cell.met is None for row in rows for cell in row.cells)
    assert table.verdict(rows) == "No scene has been run yet."


def test_another_methods_columns_are_a_line_each():
    """A record with a new field and a column for it: it stands in the table, the JSON, Markdown."""
    column = table.Column("Solved, ours", "ours_solved", published="Solved", goal=True)
    scene = Ended(
        "noisy-5-000",
        fingerprint(),
        1.0,
        {**asdict(record("noisy-5-000")), "ours_solved": True},
    )
    every = [scene.name]
    rows = table.tabulate(every, {scene.name: scene}, (*table.COLUMNS, column))
    assert rows[0].cells[-1].text == "1.00 (0.38)" and rows[0].cells[-1].met
    assert "| Solved, ours |" in table.markdown(rows, [scene], MADE)
    assert "Solved, ours" in table.document(rows, [scene], MADE)
    (without,) = table.tabulate(every, by_name([ended(every[0], record(every[0]))]))
    assert "Solved, ours" not in [cell.column for cell in without.cells]


def test_the_papers_figures_are_those_of_the_issue():
    """Full and Solved as the text of section 6.1 means them, so Solved is never above Full.

    By the text, three noiseless five-light scenes fail and three more are not the true lighting.
    """
    full = [published.figure(row, "Full") for row in published.ROWS]
    solved = [published.figure(row, "Solved") for row in published.ROWS]
    assert full == [1.00, 1.00, 1.00, 0.97, 0.99, 0.98, 0.95, 0.84]
    assert solved == [1.00, 1.00, 1.00, 0.94, 0.78, 0.73, 0.64, 0.38]
    assert list(published.ROWS) == [f"{k}-{i}" for k in ("noiseless", "noisy") for i in range(2, 6)]


# the files and the page


def write_files(out: Path, scenes: Sequence[Ended], every: Sequence[str]) -> Path:
    rows = table.tabulate(every, by_name(scenes))
    (out / "table1.md").write_text(table.markdown(rows, scenes, MADE))
    (out / "table1.json").write_text(table.document(rows, scenes, MADE))
    return out


@pytest.fixture
def drawn(tmp_path: Path) -> Path:
    """A folder with the files of a run: two rows, one scene crashed, two not solved."""
    every = names(3, "noiseless-2", "noisy-5")
    scenes = [ended(name, record(name)) for name in every]
    scenes[1] = ended(every[1], record(every[1], solved=False, reason=HOSTILE))
    scenes[4] = ended(every[4], None, "ValueError: no (levenberg.py, line 3)")
    scenes[5] = ended(every[5], record(every[5], solved=False, full=False, mse=0.25))
    return write_files(tmp_path, scenes, every)


def links(page: Path) -> list[str]:
    return re.findall(r'(?:href|src)="([^"]*)"', page.read_text())


def test_markdown_has_a_row_a_row_and_says_what_made_it(drawn):
    text = (drawn / "table1.md").read_text()
    rows = [line for line in text.splitlines() if line.startswith("| no")]
    assert [row.split(" | ")[0] for row in rows] == ["| noiseless, 2", "| noisy, 5"]
    assert "0.67 (1.00)" in rows[0] and "**" in rows[0]
    assert "abc1234" in text and "2026-11-22" in text and "2 CPUs" in text


def test_json_has_every_record(drawn):
    content = json.loads((drawn / "table1.json").read_text())
    assert content["made"] == MADE
    assert [row["name"] for row in content["rows"]] == ["noiseless-2", "noisy-5"]
    assert content["rows"][0]["cells"][1]["paper"] == 1.0
    assert len(content["scenes"]) == 6
    assert content["scenes"][0]["record"] == asdict(record("noiseless-2-000"))


def test_page_lists_what_was_not_solved_crashed_first_and_fetches_nothing(drawn):
    page = write_table1(drawn)
    text = page.read_text()
    kinds = re.findall(r'<tr data-outcome="(\w+)">\s*<td data-sort="([^"]*)"', text)
    assert kinds == [
        ("crashed", "noisy-5-001"),
        ("shown", "noiseless-2-001"),
        ("failed", "noisy-5-002"),
    ]
    assert "ValueError: no (levenberg.py, line 3)" in text
    assert text.count('class="scene"') + text.count('class="scene unsolved"') == 5 + 2  # and keys
    assert HOSTILE not in text and "alert" in text
    for link in links(page):
        assert not re.match(r"(?i)(https?:)?//", link)
        assert link.startswith("data:") or (drawn / link).is_file(), link


def test_page_of_a_table_that_has_hardly_begun(tmp_path):
    """Without a single scene the page is drawn, and has no picture of runtimes."""
    page = write_table1(write_files(tmp_path, [], names(2)))
    assert "No scene has been run yet." in page.read_text()
    assert "A row has 2 scenes here, the paper's 100." in page.read_text().replace("&#39;", "'")
    assert "<svg" not in page.read_text()


def test_report_links_to_the_table(drawn):
    """In a suite's folder, or in table1/ below it, a table gets a page; alone, it is the page."""
    assert write(drawn) == drawn / "index.html"  # no suite: the table itself
    save_run(drawn, [a_result("one", "crashed")])
    assert "table1.html" in links(write(drawn))
    (drawn / "table1").mkdir()
    for name in ("table1.json", "table1.md"):
        (drawn / name).rename(drawn / "table1" / name)
    write(drawn)
    page = drawn / "table1.html"
    assert {"index.html", "table1/table1.json", "table1/table1.md"} <= set(links(page))
    assert all(link.startswith("data:") or (drawn / link).is_file() for link in links(page))
    (drawn / "table1" / "table1.json").unlink()
    assert "table1.html" not in links(write(drawn))


@pytest.mark.parametrize("content", ["", "[]", '{"schema": 1, "rows": []}', '{"schema": 7}'])
def test_a_broken_table_is_named(tmp_path, content, refuses):
    path = tmp_path / "table1.json"
    path.write_text(content)
    with refuses(str(path)):
        write_table1(tmp_path)
