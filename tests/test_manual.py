"""The manual, input/README.md and the pages in input/manual: its card reference is what the program prints, its decks are good decks.

UNILAT names the program.
"""
import graphlib
import json
import os
import pathlib
import re
import subprocess

import pytest
from unilat.manual import book
from unilat.manual.__main__ import generated
from unilat.manual.card_table import read_cards

INPUT = pathlib.Path(__file__).parent.parent / "input"
PAGES = {path.relative_to(INPUT).as_posix(): path.read_text(encoding="utf-8") for path in [INPUT / "README.md", *sorted(INPUT.glob("manual/*.md"))]}


def page(name: str) -> str:
    """The text of a page of the manual."""
    return PAGES[f"manual/{name}.md"]



def unilat(*arguments, stdin=""):
    return subprocess.run([os.environ["UNILAT"], *arguments], input=stdin, capture_output=True, text=True,
                          encoding="utf-8", timeout=60)


def test_what_is_generated_is_up_to_date():
    """The page of cards, the table of columns and the grammars for editors; `input/run manual --pages` writes them."""
    for file, text in generated(INPUT.parent, os.environ["UNILAT"]).items():
        assert file.read_text(encoding="utf-8") == text, f"{file} is not what the program makes: input/run manual --pages"
    there = {path for path in (INPUT.parent / ".editors").rglob("*") if path.is_file()}
    assert there == {file for file in generated(INPUT.parent, os.environ["UNILAT"]) if ".editors" in file.parts}


def test_every_card_has_an_example_from_a_deck_and_the_program_reads_it():
    """Whatever else is on the page, the deck that is named has the lines, and is a good one."""
    sections = re.split(r"^## `\*([A-Z ]+)`$", page("cards"), flags=re.MULTILINE)[1:]
    assert sections[::2] == sorted(card.keyword for card in read_cards(os.environ["UNILAT"])) and len(sections) > 80
    for keyword, text in zip(sections[::2], sections[1::2]):
        name, lines = re.search(r"Example, from \[(\S+)\].*?```inp-part\n(.*?)```", text, re.DOTALL).groups()
        deck = "\n".join(line for line in (INPUT / name).read_text(encoding="utf-8").splitlines() if not line.startswith("**")) + "\n"
        assert lines in deck and lines.startswith(f"*{keyword}"), keyword


def test_grammar_of_vs_code_knows_every_card_line_of_the_decks():
    grammar = json.loads((INPUT.parent / ".editors/vscode/syntaxes/unilat.tmLanguage.json").read_text(encoding="utf-8"))
    card, wrong = grammar["patterns"][1]["begin"], grammar["patterns"][2]["match"]
    lines = [line for deck in INPUT.glob("*.inp") for line in deck.read_text(encoding="utf-8").splitlines() if re.match(r"\*[^*]", line)]
    assert len(lines) > 500 and all(re.match(card, line) for line in lines)
    assert re.match(card, "*fieldoutput, every=3") and not re.match(card, "*NODES") and re.match(wrong, "*NODES")
    names = re.compile(grammar["patterns"][1]["patterns"][0]["match"])
    assert names.findall("*ARC, ELSET=A, TYPE=GE8, WRONG=1") == ["ELSET", "TYPE"]
    snippets = json.loads((INPUT.parent / ".editors/vscode/snippets/unilat.json").read_text(encoding="utf-8"))
    assert snippets["*CONTACT"]["body"] == ["*CONTACT, OBSTACLE=${1:name}, NSET=${2:name}"]


def test_the_book_tells_headings_of_the_same_name_from_each_other():
    html = ('role="main"><section id="a"><h1>A</h1><a href="#document-manual/guide#contact">x</a></section>'
            '<span id="document-manual/guide"><section id="contact"><a href="#contact">y</a></section>'
            '<span id="document-manual/cards"><section id="contact"><a href="#document-manual/guide">z</a></section>'
            '<div class="clearer"><div class="sphinxsidebarwrapper"><ul><li><a href="#document-manual/cards#contact">w</a></li></ul>')
    made = book.book(html, "1.0")
    anchors = re.findall(r'id="([^"]+)"', made)
    assert len(set(anchors)) == len(anchors) and {"guide--contact", "cards--contact", "guide--"} <= set(anchors)
    assert re.findall(r'href="#([^"]+)"', made) == ["cards--contact", "guide--contact", "guide--contact", "guide--"]


def test_links_of_the_index_lead_to_a_card():
    printed = unilat("--cards").stdout
    links = re.findall(r"\[`\*([A-Z ]+)`\]\(#([a-z-]+)\)", printed)
    headings = re.findall(r"^### `\*([A-Z ]+)`$", printed, re.MULTILINE)
    assert [keyword for keyword, _ in links] == headings
    assert all(anchor == keyword.lower().replace(" ", "-") for keyword, anchor in links)


def test_decks_of_the_manual_are_good():
    decks = [deck for text in PAGES.values() for deck in re.findall(r"```inp\n(.*?)```", text, re.DOTALL)]
    assert decks
    for deck in decks:
        run = unilat("--check", stdin=deck)
        assert run.returncode == 0, run.stderr


def test_help_is_in_the_manual():
    """Exit codes are told twice, and must agree: each number with the first words of its meaning."""
    told = re.findall(r"([0-3]) ((?:path complete|error in the deck|stopped early|internal error))",
                      unilat("--help").stdout)
    assert [code for code, _ in told] == ["0", "1", "2", "3"]
    text = page("output")
    for code, meaning in told:
        assert re.search(rf"^\| {code} \| {meaning}", text, re.MULTILINE)


def test_what_the_page_on_the_paper_names_is_there():
    """Decks and routines of the table "from the paper to the program"."""
    chapter = page("verification").split("## From the paper to the program")[1].split("\n## ")[0]
    rows = [row.split("|")[1:-1] for row in chapter.splitlines() if row.startswith("| ") and "routine" not in row]
    assert len(rows) > 15
    decks = [deck for row in rows for deck in re.findall(r"`([a-z0-9-]+\.inp)`", row[1])]
    routines = [routine for row in rows for routine in re.findall(r"`((?:[a-z_]+/)+[a-z0-9_]+)`", row[3])]
    assert decks and all((INPUT / deck).exists() for deck in decks)
    assert all(re.search(r"`[a-z_]+/", row[3]) for row in rows)
    assert all((INPUT.parent / "src" / f"{routine}.f90").exists() for routine in routines), routines


def test_modules_that_the_page_for_developers_names_are_there():
    """In its table of extensions, with their folders."""
    table = page("developers").split("What an extension touches")[1].split("\n\n")[1]
    named = re.findall(r"`((?:[a-z_]+/)+[a-z0-9_]+)`", table)
    assert len(named) > 20
    assert [name for name in named if not (INPUT.parent / "src" / f"{name}.f90").exists()] == []


def test_sweep_file_of_the_manual_is_good(tmp_path):
    import sys
    sys.path.insert(0, str(INPUT.parent / "postproc"))
    from unilat.sweep.sweep_file import read_sweep
    (text,) = re.findall(r"```toml\n(.*?)```", page("output"), re.DOTALL)
    (tmp_path / "column-random.inp").write_text("*HEADING\n${gap} ${EI} ${a1} ${a2}\n")
    (tmp_path / "a.toml").write_text(text)
    assert len(read_sweep(str(tmp_path / "a.toml")).values) == 3 * 5 * 200


def test_links_lead_somewhere():
    """Within a page, to other pages, to pictures and decks."""
    anchors = {name: {re.sub(r"[^a-z0-9 _-]", "", title.lower()).replace(" ", "-") for title in re.findall(r"^#+ (.*)$", text, re.MULTILINE)}
               for name, text in PAGES.items()}
    for name, text in PAGES.items():
        for file, anchor in re.findall(r"\]\(([^)#:\s]*)(?:#([^)\s]+))?\)", text):
            target = os.path.normpath(os.path.join(os.path.dirname(name), file)) if file else name
            assert (INPUT / target).exists(), f"{name}: {file}"
            assert not anchor or anchor in anchors[target], f"{name}: {file}#{anchor}"


def test_the_error_that_the_manual_shows():
    deck = re.search(r"```inp ruler.inp\n(.*?)```", page("tutorial"), re.DOTALL).group(1).replace("\n2, U2, -1\n", "\n20, U2, -1\n")
    shown = re.search(r"```\n(ruler\.inp:.*?)```", page("guide"), re.DOTALL).group(1)
    assert unilat("--check", stdin=deck).stderr.replace("<stdin>", "ruler.inp").startswith(shown)


def test_what_is_quoted_of_the_ring_is_its_own(tmp_path):
    """Critical load and bar on the first page, the row in the chapter on error bars: to the last digit but one, bars to a fifth."""
    printed = subprocess.run([os.environ["UNILAT"], "-o", str(tmp_path / "ring.h5"), str(INPUT / "ring.inp")],
                             capture_output=True, text=True, encoding="utf-8", timeout=60).stdout

    def numbers(line):
        return [float(word) for word in re.findall(r"(?<![\w.])\d+\.\d+(?:E[-+]\d+)?", line)]

    def row(text, start, end):
        return numbers(re.findall(rf"^ {start} .*{end}$", text, re.MULTILINE)[0])

    own, quoted = (row(text, "LP", "limit point of the load") for text in (printed, page("guide")))
    front = re.search(r"critical load ([\d.]+) \+- ([\d.E-]+), exact", (INPUT.parent / "README.md").read_text(encoding="utf-8"))
    assert len(own) == len(quoted) == 6, f"{own} {quoted}"
    for k in (0, 2, 3, 4):
        assert abs(own[k] - quoted[k]) <= 1e-6 * abs(own[k])
    assert abs(own[0] - float(front[1])) <= 2e-8 * own[0]
    for k, bar in ((1, quoted[1]), (5, quoted[5]), (1, float(front[2]))):
        assert 0.8 < own[k] / bar < 1.25, f"bar {own[k]}, quoted {bar}"
    own, quoted = (row(text, "UZ .*  62.00000000", "value asked for") for text in (printed, page("guide")))
    assert len(own) == len(quoted) == 4 and own[:3] == pytest.approx(quoted[:3], rel=1e-6) and 0.8 < own[3] / quoted[3] < 1.25, f"{own} {quoted}"
    elements = int(re.search(r"^ *elements at the most +(\d+)$", printed, re.MULTILINE)[1])
    assert f"The ring of `ring.inp` needs {elements}." in page("guide")


def sentences(text: str):
    """Sentences of a page, and cells of its tables: without code, links and pictures."""
    for pattern, instead in ((r"^```.*?^```$", "\n"), (r"<!--.*?-->", ""), (r"^    .*$", ""), (r"!\[[^\]]*\]\([^)]*\)", ""), (r"\[([^\]]*)\]\([^)]*\)", r"\1"),
                             (r"`[^`]*`", "CODE"), (r"^#.*$", "")):
        text = re.sub(pattern, instead, text, flags=re.MULTILINE | re.DOTALL if pattern.startswith(("^```", "<!--")) else re.MULTILINE)
    for part in re.split(r"\n\s*\n|\n(?=\s*[*-] )|\n(?=\d+\. )", text):
        table = part.lstrip().startswith("|")
        for piece in re.split(r"[|\n]", part) if table else [part]:
            yield from re.split(r"(?<=[.!?])[)*\"]*\s+(?=[A-Z(\"*0-9])", " ".join(piece.split()))


@pytest.mark.parametrize("name", sorted(PAGES))
def test_sentences_are_short(name):
    """At most 30 words."""
    long = [sentence for sentence in sentences(PAGES[name]) if len(re.findall(r"\S*[A-Za-z0-9]\S*", sentence)) > 30]
    assert not long, "\n".join(long)


def test_a_long_sentence_would_be_seen():
    assert max(len(sentence.split()) for sentence in sentences("Short. Word " + "word " * 30 + "`a b`.\n\n| a | " + "b " * 32 + "|")) == 32


def test_what_people_search_for_is_there():
    """What the program is, in the words of the field, on the first screen of the first page and in the guide."""
    front = (INPUT.parent / "README.md").read_text(encoding="utf-8")
    first_screen = "\n".join(front.splitlines()[:16])
    for word in ("plane", "static", "elastic", "frictionless", "unilateral", "plasticity", "dynamics"):
        assert word in first_screen
    for name in ("guide", "glossary"):
        assert "unilateral" in page(name) and "frictionless" in page(name)
    terms = [row.split("|")[1].strip() for row in page("glossary").splitlines() if row.startswith("| ")][1:]
    assert terms == sorted(terms, key=lambda term: re.sub(r"[^a-z ]", "", term.lower()).strip()) and len(terms) > 40


def test_citation_and_changes_name_this_version():
    version = re.search(r"VERSION ([\d.]+) DESCRIPTION", (INPUT.parent / "CMakeLists.txt").read_text(encoding="utf-8"))[1]
    assert f"\nversion: {version}\n" in (INPUT.parent / ".github/CITATION.cff").read_text(encoding="utf-8")
    assert f"## {version}" in page("changelog")


def test_links_of_the_first_page_lead_somewhere():
    links = re.findall(r"\]\(([^)#]+)\)", (INPUT.parent / "README.md").read_text(encoding="utf-8"))
    assert len(links) > 5 and all((INPUT.parent / link).exists() for link in links)


def test_folders_of_the_page_for_developers_are_those_of_the_source():
    """All of them, and the modules that one should read first are in them."""
    source = INPUT.parent / "src"
    rows = [row.split("|")[1:-1] for row in page("developers").split("| folder in `src` |")[1].split("\n\n")[0].splitlines() if row.startswith("| `")]
    named = {folder for row in rows for folder in re.findall(r"`(\w+)`", row[0])}
    assert named == {path.name for path in source.iterdir() if path.is_dir()}
    for folders, _, modules in rows:
        there = {path.stem for folder in re.findall(r"`(\w+)`", folders) for path in (source / folder).rglob("*.f90")}
        assert set(re.findall(r"`(\w+)`", modules)) <= there, folders


def folders_used_by_folders(parent):
    """Of the folders in a folder: those whose modules each of them uses."""
    files = list(parent.glob("*/**/*.f90"))
    folder = {path.stem: path.relative_to(parent).parts[0] for path in files}
    used = {name: set() for name in folder.values()}
    for path in files:
        modules = re.findall(r"^ *use (\w+)", path.read_text(encoding="utf-8"), re.MULTILINE)
        used[folder[path.stem]] |= {folder[name] for name in modules if name in folder} - {folder[path.stem]}
    return used


def test_folders_of_the_source_use_each_other_one_way():
    """Whatever a folder uses, directly or through others, does not use it in turn: no model knows of cards, nor an element of paths."""
    used = folders_used_by_folders(INPUT.parent / "src")
    assert {"base", "model"} <= used["deck"]
    graphlib.TopologicalSorter(used).prepare()  # an error names a circle


def test_folders_of_the_path_use_only_those_above_them_on_the_page():
    used = folders_used_by_folders(INPUT.parent / "src" / "path")
    table = page("developers").split("| folder in `src/path` |")[1].split("\n\n")[0]
    above = re.findall(r"^\| `(\w+)` \|", table, re.MULTILINE)
    assert set(above) == set(used)
    wrong = {name: used[name] - set(above[:place]) for place, name in enumerate(above)}
    assert not any(wrong.values()), wrong


def test_modules_beside_the_diagrams_of_the_theory_are_there():
    """Their names stand in the right column."""
    there = {path.stem for path in (INPUT.parent / "src").rglob("*.f90")}
    diagrams = page("theory").split("\nIn general:\n")[1].split("\n### ")[0]
    column = [line[70:] for line in diagrams.splitlines() if line.startswith("    ")]
    named = [name for text in column for name in re.findall(r"\b[a-z]+(?:_[a-z]+)+\b", text)]
    assert len(named) > 20 and not [name for name in named if name not in there]
