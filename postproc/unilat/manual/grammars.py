"""Grammars of decks for editors, from the card table: syntax and completion for VS Code, syntax for Vim."""

from __future__ import annotations

import json

from .card_table import Card

NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][-+]?\d+)?"


def files(cards: list[Card], version: str) -> dict[str, str]:
    """Text of every file by its path in the folder of editors."""
    return {"vscode/package.json": _json(_package(version)), "vscode/language-configuration.json": _json({"comments": {"lineComment": "**"}}),
            "vscode/syntaxes/unilat.tmLanguage.json": _json(_textmate(cards)), "vscode/snippets/unilat.json": _json(_snippets(cards)),
            "vim/syntax/unilat.vim": _vim(cards), "vim/ftdetect/unilat.vim": "autocmd BufRead,BufNewFile *.inp setfiletype unilat\n"}


def _json(content) -> str:
    return json.dumps(content, indent=2, ensure_ascii=False) + "\n"


def _package(version: str) -> dict:
    return {"name": "unilat", "displayName": "Decks of unilat", "description": "Syntax and cards of decks for unilat", "version": version,
            "publisher": "unilat", "engines": {"vscode": "^1.60.0"}, "categories": ["Programming Languages", "Snippets"],
            "contributes": {
                "languages": [{"id": "unilat", "aliases": ["unilat deck"], "extensions": [".inp"],
                               "configuration": "./language-configuration.json"}],
                "grammars": [{"language": "unilat", "scopeName": "source.unilat", "path": "./syntaxes/unilat.tmLanguage.json"}],
                "snippets": [{"language": "unilat", "path": "./snippets/unilat.json"}]}}


def _any(words) -> str:
    """A regular expression for any of the words; blanks inside them do not count."""
    return "|".join(word.replace(" ", r"\s*") for word in sorted(words, key=lambda word: (-len(word), word)))


def _names(cards: list[Card]) -> set[str]:
    return {parameter.name for card in cards for parameter in card.parameters}


def _textmate(cards: list[Card]) -> dict:
    keywords, words = _any(card.keyword for card in cards), _any(set().union(*(card.words for card in cards)))
    value = [{"name": "comment.line.unilat", "match": r"^\s*\*\*.*$"},
             {"name": "variable.other.unilat", "match": r"\$\{[^}]*\}?"},
             {"name": "string.quoted.unilat", "match": '"[^"]*"'}]
    return {"$schema": "https://raw.githubusercontent.com/martinring/tmlanguage/master/tmlanguage.json", "name": "unilat deck",
            "scopeName": "source.unilat", "patterns": [
                value[0],
                {"begin": rf"(?i)^\s*(\*)\s*({keywords})\s*(?=,|$)", "end": r"$",
                 "beginCaptures": {"1": {"name": "punctuation.definition.keyword.unilat"}, "2": {"name": "keyword.control.unilat"}},
                 "patterns": [{"match": rf"(?i)(?<=,)\s*({_any(_names(cards))})\s*(?==|,|$)", "name": "entity.other.attribute-name.unilat"},
                              {"match": rf"(?i)(?<==)\s*({words})\s*(?=,|$)", "name": "constant.language.unilat"}, *value[1:],
                              {"match": rf"(?<==)\s*{NUMBER}", "name": "constant.numeric.unilat"}]},
                {"name": "invalid.illegal.unilat", "match": r"^\s*\*[^*,]*"},
                *value[1:],
                {"match": rf"(?i)(?<=,|^)\s*({words})\s*(?=,|$)", "name": "constant.language.unilat"},
                {"match": rf"(?<![\w.]){NUMBER}(?![\w.])", "name": "constant.numeric.unilat"}]}


def _snippets(cards: list[Card]) -> dict:
    """Each card with the parameters that it needs and the form of data lines that these have."""
    snippets = {}
    for card in cards:
        body, stop = f"*{card.keyword}", 0
        for parameter in card.parameters:
            if parameter.required:
                stop += 1
                choice = f"|{','.join(parameter.words)}|" if parameter.words else f":{parameter.value}"
                body += f", {parameter.name}=${{{stop}{choice}}}"
        lines = [body]
        if card.data_lines:
            fields = []
            always = [line for when, line in card.data_lines if when in ("", "otherwise")]
            for name in (always or [line for _, line in card.data_lines])[0].split(", "):
                stop += 1
                fields.append(name if name == "..." else f"${{{stop}:{name}}}")
            lines.append(", ".join(fields))
        snippets[f"*{card.keyword}"] = {"prefix": f"*{card.keyword}", "body": lines, "description": card.purpose}
    return snippets


def _vim(cards: list[Card]) -> str:
    def any_of(words) -> str:
        return r"\|".join(word.replace(" ", r"\s*") for word in sorted(words, key=lambda word: (-len(word), word)))

    words = set().union(*(card.words for card in cards))
    return "\n".join((
        '" Syntax of decks for unilat, written from its card table.',
        'if exists("b:current_syntax")', "  finish", "endif", "syntax case ignore",
        r"syntax match unilatUnknown /^\s*\*[^*,][^,]*/",
        rf"syntax match unilatCard /^\s*\*\s*\({any_of(card.keyword for card in cards)}\)\s*\ze\(,\|$\)/",
        rf"syntax match unilatParameter /,\s*\zs\({any_of(_names(cards))}\)\s*\ze\(=\|,\|$\)/",
        rf"syntax match unilatWord /\(=\|,\|^\)\s*\zs\({any_of(words)}\)\s*\ze\(,\|$\)/",
        r"syntax match unilatNumber /\(^\|[^A-Za-z0-9_.]\)\zs[-+]\?\(\d\+\.\?\d*\|\.\d\+\)\([eEdD][-+]\?\d\+\)\?\ze\($\|[^A-Za-z0-9_.]\)/",
        r"syntax match unilatValue /\${[^}]*}/",
        r'syntax match unilatText /"[^"]*"/',
        r"syntax match unilatComment /^\s*\*\*.*/",
        "highlight default link unilatUnknown Error", "highlight default link unilatCard Keyword",
        "highlight default link unilatParameter Identifier", "highlight default link unilatWord Constant",
        "highlight default link unilatNumber Number", "highlight default link unilatValue PreProc",
        "highlight default link unilatText String", "highlight default link unilatComment Comment",
        'let b:current_syntax = "unilat"', ""))
