"""The manual, input/README.md: its card reference is what the program prints, its decks are good decks.

UNILAT names the program.
"""
import os
import pathlib
import re
import subprocess

MANUAL = pathlib.Path(__file__).parent.parent / "input" / "README.md"
BEGIN = "<!-- cards: begin; written by `unilat --cards` -->\n"
END = "<!-- cards: end -->\n"


def unilat(*arguments, stdin=""):
    return subprocess.run([os.environ["UNILAT"], *arguments], input=stdin, capture_output=True, text=True,
                          encoding="utf-8", timeout=60)


def test_card_reference_is_the_programs_own():
    text = MANUAL.read_text(encoding="utf-8")
    assert text.count(BEGIN) == 1 and text.count(END) == 1
    reference = text.split(BEGIN)[1].split(END)[0]
    printed = unilat("--cards")
    assert printed.returncode == 0
    assert reference.strip() == printed.stdout.strip()


def test_links_of_the_index_lead_to_a_card():
    printed = unilat("--cards").stdout
    links = re.findall(r"\[`\*([A-Z ]+)`\]\(#([a-z-]+)\)", printed)
    headings = re.findall(r"^### `\*([A-Z ]+)`$", printed, re.MULTILINE)
    assert [keyword for keyword, _ in links] == headings
    assert all(anchor == keyword.lower().replace(" ", "-") for keyword, anchor in links)


def test_decks_of_the_manual_are_good():
    decks = re.findall(r"```inp\n(.*?)```", MANUAL.read_text(encoding="utf-8"), re.DOTALL)
    assert decks
    for deck in decks:
        run = unilat("--check", stdin=deck)
        assert run.returncode == 0, run.stderr


def test_help_is_in_the_manual():
    """Exit codes are told twice, and must agree: each number with the first words of its meaning."""
    told = re.findall(r"([0-3]) ((?:path complete|error in the deck|stopped early|internal error))",
                      unilat("--help").stdout)
    assert [code for code, _ in told] == ["0", "1", "2", "3"]
    text = MANUAL.read_text(encoding="utf-8")
    for code, meaning in told:
        assert re.search(rf"^\| {code} \| {meaning}", text, re.MULTILINE)


def test_what_the_page_on_the_paper_names_is_there():
    """Decks and routines of the table "from the paper to the program"."""
    page = MANUAL.read_text(encoding="utf-8").split("## From the paper to the program")[1].split("\n## ")[0]
    rows = [row.split("|")[1:-1] for row in page.splitlines() if row.startswith("| ") and "routine" not in row]
    assert len(rows) > 15
    decks = [deck for row in rows for deck in re.findall(r"`([a-z0-9-]+\.inp)`", row[1])]
    routines = [routine for row in rows for routine in re.findall(r"`([a-z]+/[a-z0-9_]+)`", row[3])]
    assert decks and all((MANUAL.parent / deck).exists() for deck in decks)
    assert all(re.search(r"`[a-z]+/", row[3]) for row in rows)
    assert all((MANUAL.parent.parent / "src" / f"{routine}.f90").exists() for routine in routines), routines


def test_sweep_file_of_the_manual_is_good(tmp_path):
    import sys
    sys.path.insert(0, str(MANUAL.parent.parent / "postproc"))
    from unilat.sweep.sweep_file import read_sweep
    (text,) = re.findall(r"```toml\n(.*?)```", MANUAL.read_text(encoding="utf-8"), re.DOTALL)
    (tmp_path / "column-random.inp").write_text("*HEADING\n${gap} ${EI} ${a1} ${a2}\n")
    (tmp_path / "a.toml").write_text(text)
    assert len(read_sweep(str(tmp_path / "a.toml")).values) == 3 * 5 * 200


def test_links_lead_somewhere():
    """Within a page, to the other page, to pictures."""
    pages = {name: (MANUAL.parent / name).read_text(encoding="utf-8") for name in ("README.md", "theory.md")}
    anchors = {name: {re.sub(r"[^a-z0-9 _-]", "", title.lower()).replace(" ", "-") for title in re.findall(r"^#+ (.*)$", text, re.MULTILINE)}
               for name, text in pages.items()}
    for name, text in pages.items():
        links = re.findall(r"\]\(([^)#:\s]*)(?:#([^)\s]+))?\)", text)
        assert links
        for file, anchor in links:
            assert (MANUAL.parent / (file or name)).exists(), file
            assert not anchor or anchor in anchors[file or name], anchor


def test_the_error_that_the_manual_shows():
    text = MANUAL.read_text(encoding="utf-8")
    deck = re.search(r"```inp ruler.inp\n(.*?)```", text, re.DOTALL).group(1).replace("\n2, U2, -1\n", "\n20, U2, -1\n")
    shown = re.search(r"```\n(ruler\.inp:.*?)```", text, re.DOTALL).group(1)
    assert unilat("--check", stdin=deck).stderr.replace("<stdin>", "ruler.inp").startswith(shown)


def test_what_is_quoted_of_the_ring_is_its_own(tmp_path):
    """Critical load and bar on the first page, the row in the chapter on error bars: to the last digit but one, bars to a fifth."""
    printed = subprocess.run([os.environ["UNILAT"], "-o", str(tmp_path / "ring.h5"), str(MANUAL.parent / "ring.inp")],
                             capture_output=True, text=True, encoding="utf-8", timeout=60).stdout

    def numbers(line):
        return [float(word) for word in re.findall(r"(?<![\w.])\d+\.\d+(?:E[-+]\d+)?", line)]

    own = numbers(re.findall(r"^ LP .*limit point of the load$", printed, re.MULTILINE)[0])
    quoted = numbers(re.findall(r"^ LP .*limit point of the load$", MANUAL.read_text(encoding="utf-8"), re.MULTILINE)[0])
    front = re.search(r"critical load ([\d.]+) \+- ([\d.E-]+), exact", (MANUAL.parent.parent / "README.md").read_text(encoding="utf-8"))
    assert len(own) == len(quoted) == 6, f"{own} {quoted}"
    for k in (0, 2, 3, 4):
        assert abs(own[k] - quoted[k]) <= 1e-6 * abs(own[k])
    assert abs(own[0] - float(front[1])) <= 2e-8 * own[0]
    for k, bar in ((1, quoted[1]), (5, quoted[5]), (1, float(front[2]))):
        assert 0.8 < own[k] / bar < 1.25, f"bar {own[k]}, quoted {bar}"
