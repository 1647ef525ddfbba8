"""The manual as a static site with search and as a PDF, from the same pages.

Needs sphinx, myst-parser, furo and weasyprint, which `input/run manual` installs in a folder of its own.
"""

from __future__ import annotations

import pathlib
import re
import subprocess
import sys

SETTINGS = pathlib.Path(__file__).parent     # of conf.py
STYLE = """
@page { size: A4; margin: 22mm 20mm; @bottom-center { content: counter(page); font: 9pt sans-serif } }
@page :first { @bottom-center { content: none } }
body { font: 10pt/1.4 "DejaVu Serif", serif; hyphens: auto }
h1 { page-break-before: always; font-size: 20pt } h1.book { page-break-before: avoid; margin-top: 60mm; font-size: 30pt }
h1, h2, h3, h4 { hyphens: none; page-break-after: avoid; font-family: "DejaVu Sans", sans-serif } h2 { font-size: 14pt; margin-top: 8mm }
h3 { font-size: 11pt } a { color: #0b5394; text-decoration: none } a.headerlink { display: none }
code, pre { font: 8pt "DejaVu Sans Mono", monospace; hyphens: none } pre { background: #f4f4f4; padding: 2mm; white-space: pre-wrap }
table { border-collapse: collapse; font-size: 8pt; margin: 3mm 0; hyphens: none; width: 100% } tr { page-break-inside: avoid }
th, td { border: 0.2pt solid #999; padding: 0.5mm 1.5mm; vertical-align: top; overflow-wrap: anywhere; text-align: left }
td p, th p { margin: 0 } th { background: #eee; white-space: nowrap; overflow-wrap: normal } h2 code { font-size: 12pt } img { max-width: 100%; max-height: 90mm; display: block; margin: 3mm auto }
ul.contents, ul.contents ul { list-style: none } ul.contents { padding-left: 0 }
ul.contents a::after { content: leader('.') target-counter(attr(href), page) }
"""


def write_site(root: pathlib.Path, folder: pathlib.Path) -> None:
    """The site in `folder`; CalledProcessError when a link of a page leads nowhere."""
    _sphinx("html", root, folder)
    (folder / "index.html").write_text('<meta http-equiv="refresh" content="0; url=README.html">\n', encoding="utf-8")


def write_pdf(root: pathlib.Path, folder: pathlib.Path, file: pathlib.Path, version: str) -> None:
    """All pages as one book, with contents and links between them; what Sphinx makes on the way is in `folder`."""
    import weasyprint
    _sphinx("singlehtml", root, folder, "-D", "html_theme=basic")
    html = (folder / "README.html").read_text(encoding="utf-8")
    weasyprint.HTML(string=book(html, version), base_url=f"{folder}/").write_pdf(str(file))


def _sphinx(builder: str, root: pathlib.Path, folder: pathlib.Path, *options: str) -> None:
    subprocess.run([sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-b", builder, *options, "-c", str(SETTINGS), str(root / "input"),
                    str(folder)], check=True)


def book(html: str, version: str) -> str:
    """Sphinx's single page as a book: contents in front, and headings of the same name told from each other by their page."""
    body = html.split('role="main">')[1].split('<div class="clearer">')[0]
    contents = re.search(r'sphinxsidebarwrapper">.*?(<ul>.*</ul>)', html, re.DOTALL)[1].replace("<ul>", '<ul class="contents">', 1)
    parts = re.split(r'<span id="document-manual/(\w+)">', body)
    pages = [_named(parts[0], "README")] + [f'<span id="{page}--">' + _named(text, page) for page, text in zip(parts[1::2], parts[2::2])]
    return (f"<html><head><meta charset='utf-8'><title>unilat {version}</title><style>{STYLE}</style></head><body>"
            f"<h1 class='book'>unilat {version}</h1><p>Plane rods with unilateral, frictionless contact. The manual.</p><h1>Contents</h1>"
            f"{_named(contents, 'README')}{''.join(pages)}</body></html>")


def _named(html: str, page: str) -> str:
    """Anchors of a page with its name in front, here and in what leads to them."""
    html = re.sub(r'id="([^"]+)"(?=[ >])', lambda match: match[0] if match[1].endswith("--") else f'id="{page}--{match[1]}"', html)
    html = re.sub(r'href="#(?!document-)([^"]+)"', rf'href="#{page}--\1"', html)
    return re.sub(r'href="#document-(?:manual/)?(\w+)#?([^"]*)"', r'href="#\1--\2"', html)
