"""How Sphinx reads the pages of the manual, which are Markdown in input/: for the site (html) and for the PDF (singlehtml)."""

project = "unilat"
extensions = ["myst_parser"]
root_doc = "README"
myst_heading_anchors = 4
exclude_patterns = ["run"]
html_theme = "furo"
html_title = "unilat"
html_copy_source = False
html_show_copyright = False
# Decks are no language that Sphinx knows; "text" colours of the listing would mean nothing.
suppress_warnings = ["misc.highlighting_failure", "myst.header"]
PAGES = ("tutorial", "guide", "cards", "output", "verification", "theory", "glossary", "developers", "changelog")


def add_contents(_, page: str, source: list[str]) -> None:
    """The list of pages, which GitHub would show as it stands, comes to the first page here."""
    if page == root_doc:
        source[0] += "\n```{toctree}\n:hidden:\n:maxdepth: 2\n\n" + "\n".join(f"manual/{name}" for name in PAGES) + "\n```\n"


def setup(app) -> None:
    app.connect("source-read", add_contents)
