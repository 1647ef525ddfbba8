#!/usr/bin/env python3
"""Writes card_table.f90: the table of cards for checks and readers, its reference as Markdown and JSON, lines of help on words, foreign words.

usage: make_cards.py CARDS OUTPUT        (CMake calls it; CARDS is src/deck/cards.txt, whose head says how it is written)
"""
import json
import pathlib
import re
import sys

PARTS = {"model": "in_model", "step": "in_step", "anywhere": "anywhere", "outside steps": "outside_step"}
PLACES = {"model": "Model part", "step": "In a step", "anywhere": "Model part or in a step", "outside steps": "After the model part"}
KINDS = {"flag": "kind_flag", "word": "kind_word", "name": "kind_name", "integer": "kind_integer", "real": "kind_real", "label": "kind_label",
         "label or set": "kind_label_or_set", "1, 2 or 6": "kind_component", "degrees of freedom": "kind_dof", "path": "kind_path",
         "name = value": "kind_value", "real or name": "kind_distributed", "formula": "kind_formula"}
BOUNDS = {"": "any_value", "> 0": "positive", ">= 0": "not_negative", "not 0": "not_zero", "> 0, < 1": "below_one", "> -1, <= 0.5": "poisson"}
ORIGINS = {"foreign": "; a word of Abaqus and CalculiX; ", "former": "; a word of earlier versions; "}


def attributes(text, known, where):
    """`at least 2; once` as {"at least": "2", "once": ""}."""
    found = {}
    for part in filter(None, text.split("; ")):
        name = next((name for name in known if part == name or part.startswith(name + " ")), None)
        if name is None:
            sys.exit(f"{where}: {part!r} is none of: {', '.join(known)}")
        found[name] = part[len(name) + 1:]
    return found


def item(line, constants, where):
    """A row: a parameter or field, two for the coordinates of a point."""
    columns = re.split(r" \|(?= )", line)
    if len(columns) != 4:
        sys.exit(f"{where}: a row has four columns: name | values | attributes | meaning")
    names, values, rest, meaning = (column.strip() for column in columns)
    unit = re.search(r" \[(.*)\]$", values)
    values = values[:unit.start()] if unit else values
    kind = next((kind for kind in sorted(KINDS, key=len, reverse=True) if values == kind or values.startswith(kind + " ")), "word")
    values = values if kind == "word" else values[len(kind) + 1:]
    has_words = kind in ("word", "degrees of freedom")
    if not has_words and values not in BOUNDS:
        sys.exit(f"{where}: {values!r} is no bound")
    given = attributes(rest, ("default", "times", "optional", "with", "at most"), where)
    row = {"kind": kind, "required": kind != "flag" and "optional" not in given and "default" not in given, "default": given.get("default", ""),
           "only": given.get("with", ""), "bound": "" if has_words else values, "unit": unit[1] if unit else "", "meaning": meaning,
           "words": constants.get(values, values).split("|") if has_words else [],
           "most": given.get("at most", ""), "times": given.get("times", "")}
    return [{"name": name} | row for name in (names.split(", ") if ", " in names and kind == "real" else [names])]


def read(path, constants):
    """The cards of the table, in its order; and the foreign words: what they are, of which card or item, words, answer."""
    cards, foreign, groups, target, meaning_next = [], [], {}, None, False
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        where, line = f"{path}:{number}", line.strip()
        if not line or line.startswith("#"):
            continue
        if line.startswith("*"):
            keyword, rest = line[1:].split(" | ")
            given = attributes(rest, (*PARTS, "once", "below", "free text"), where)
            if not set(PARTS) & set(given):
                sys.exit(f"{where}: the part of the deck is missing: {', '.join(PARTS)}")
            cards.append({"keyword": keyword, "where": next(part for part in PARTS if part in given), "once": "once" in given,
                          "free_text": "free text" in given, "follows": given.get("below", ""), "meaning": "", "parameters": [], "lines": []})
            target, group, meaning_next = cards[-1]["parameters"], None, True
        elif meaning_next:
            cards[-1]["meaning"], meaning_next = line, False
        elif (origin := line.split(" ")[0]) in ORIGINS:
            place, words, answer = line.removeprefix(origin + " ").split(" | ")
            kind, _, owner = place.partition(" of ")
            foreign.append((kind, owner, words, ("; " if kind == "field" else ORIGINS[origin]) + answer))
        elif line.startswith("rows "):
            group = target = groups.setdefault(line[5:], [])
        else:
            for row in groups[line[3:]] if line.startswith("as ") else [line] if re.match("lines(;|$)", line) else item(line, constants, where):
                if not isinstance(row, str) or group is not None:
                    target.append(row)
                    continue
                given = attributes(row[7:], ("with", "at least", "at most", "last repeats"), where)
                layout = {"when": given.get("with", ""), "least": int(given.get("at least", 1)), "last_repeats": "last repeats" in given}
                layout |= {"most": int(given["at most"])} if "at most" in given else {}
                cards[-1]["lines"].append(layout | {"fields": []})
                target = cards[-1]["lines"][-1]["fields"]
    return cards, foreign


def alternatives(words):
    return "`" + "`, `".join(words) + "`"


def value_words(row):
    """Accepted values of a parameter or field, for the reference."""
    words = {"flag": "(flag)", "word": alternatives(row["words"]), "name = value": 'name, and a number, a formula or "text"',
             "degrees of freedom": "1 to 6, or " + alternatives(row["words"])}.get(row["kind"], row["kind"])
    words += {"": "", "not 0": ", not 0"}.get(row["bound"], " " + row["bound"])
    return words + (f", at most {row['most']}" if row["most"] else "")


def section(card):
    """Lines of the reference about a card."""
    place = PLACES[card["where"]] + (f", below `*{card['follows']}`" if card["follows"] else "")
    place += {"step": ", once in each", "model": ", once"}[card["where"]] if card["once"] else ""
    yield from ("", f"### `*{card['keyword']}`", "", f"{card['meaning']} *{place}.*")
    if card["parameters"]:
        yield from ("", "| parameter | value | default | meaning |", "|---|---|---|---|")
    for row in card["parameters"]:
        name = f"`{row['name']}`" if not row["required"] or row["only"] else f"**`{row['name']}`**"
        meaning = row["meaning"] + (f"; with {alternatives(row['only'].split('|'))} only" if row["only"] else "")
        yield f"| {name} | {value_words(row)} | {row['default'] or ('required' if row['required'] else '')} | {meaning} |"
    if not card["lines"]:
        yield from ("", "No data lines.")
    for layout in card["lines"]:
        if not layout["fields"]:
            yield from ("", "Data lines: free text.")
            continue
        head = "One data line" if layout.get("most") == 1 else "Data lines"
        if len(card["lines"]) > 1:
            head += f" with {alternatives(layout['when'].split('|'))}" if layout["when"] else " otherwise"
        head += ", which may be left out" if layout["least"] == 0 else ""
        names = ", ".join(row["name"] for row in layout["fields"]) + (", ..." if layout["last_repeats"] else "")
        yield from ("", f"{head}: `{names}`", "", "| field | value | unit | default | meaning |", "|---|---|---|---|---|")
        for row in layout["fields"]:
            default = "required" if row["required"] else row["default"] + (f" times the size of {row['times']}" if row["times"] else "")
            yield f"| {row['name']} | {value_words(row)} | {row['unit']} | {default} | {row['meaning']} |"


def quoted(text):
    return "'" + text.replace("'", "''") + "'"


def printed(lines):
    return [f"      write (unit, '(a)') {quoted(line)}" for line in lines]


def text(value, room):
    """A constant of the table; `room` is the length of its component in card_spec."""
    if len(value) > room:
        sys.exit(f"{value!r} is longer than the {room} characters that card_spec has for it")
    return quoted(value)


def names_of(rows):
    return text("|".join(row["name"] for row in rows), 160)


def item_entry(row, siblings):
    words = text("|".join(row["words"]), 160)
    times = 1 + [other["name"] for other in siblings].index(row["times"]) if row["times"] else 0
    return (f"item_t({text(row['name'], 24)}, {KINDS[row['kind']]}, .{str(row['required']).lower()}., {text(row['default'], 24)}, {words}, "
            f"{text(row['only'], 80)}, {BOUNDS[row['bound']]}, {row['most'] or 'usual_most'}, {times})")


def entries(cards):
    """Entries of the table: cards, layouts and items. Items of one list stand one behind the other."""
    table, layouts, items = [], [], []
    for card in cards:
        rows, first_layout = card["parameters"], len(layouts) + 1
        first = len(items) + 1
        items += [item_entry(row, rows) for row in rows]
        table.append(f"card_spec_t({text(card['keyword'], 24)}, {quoted(card['keyword'].replace(' ', ''))}, {PARTS[card['where']]}, "
                     f".{str(card['once']).lower()}., .{str(card['free_text']).lower()}., {text(card['follows'], 24)}, "
                     f"{first}, {len(items)}, {first_layout}, {len(layouts) + len(card['lines'])}, {names_of(rows)})")
        for layout in card["lines"]:
            rows, first = layout["fields"], len(items) + 1
            items += [item_entry(row, rows) for row in rows]
            layouts.append(f"layout_t({text(layout['when'], 80)}, {layout['least']}, {layout.get('most', 'many_lines')}, "
                           f".{str(layout['last_repeats']).lower()}., {first}, {len(items)}, {names_of(rows)})")
    return {"card_spec_t cards": table, "layout_t layouts": layouts, "item_t items": items}


def topics(cards, foreign):
    """Words about which `--help` has a line, what stands before and behind the word as typed, and whether decks have the word."""
    for card in cards:
        place = f"*{card['keyword']}, "
        for row in card["parameters"]:
            yield [row["name"], *row["words"]], f"{place}{row['name']}: {row['meaning']}", None
        for row in (row for layout in card["lines"] for row in layout["fields"]):
            yield row["words"], f"{place}field {row['name']}: {row['meaning']}", None
    for kind in ("card", "parameter", "value"):
        for what, owner, words, answer in foreign:
            if what == kind:
                before = {"card": "*", "parameter": f"*{owner}, " if owner else "", "value": f"{owner} "}[kind]
                yield words.split("|"), before, ": " + answer[2:]


def module(cards, foreign):
    """Lines of the Fortran module."""
    table, lines = entries(cards), list(topics(cards, foreign))
    yield from ("!> The cards of src/deck/cards.txt: entries of the table, and the reference. Made by .cmake/make_cards.py.", "module card_table",
                "   use card_spec", "   use text, only: squeeze, word_index", "   implicit none", "   private",
                "   public :: find_card, cards, layouts, items, card_names, topic_names, write_card, write_card_manual, write_card_json, write_topic, foreign_answer",
                "   !> Keywords with their stars, between bars.", "   character(*), parameter :: card_names = " + quoted("|".join("*" + card["keyword"] for card in cards)),
                "   !> All words of decks, between bars.")
    words = [word for card in cards for word in ("*" + card["keyword"], *(word for row in card["parameters"] for word in (row["name"], *row["words"])),
                                                 *(word for layout in card["lines"] for row in layout["fields"] for word in row["words"]))]
    yield "   character(*), parameter :: topic_names = " + quoted("|".join(dict.fromkeys(words)))
    yield from (f"   type({name.split()[0]}), protected :: {name.split()[1]}({len(table[name])})" for name in table)
    for name in table:
        yield from (f"   data {name.split()[1]}({n}) /{entry}/" for n, entry in enumerate(table[name], 1))
    yield from ("contains", "   !> Position of a card in the table, 0 if there is none; case and blanks are ignored.", "   pure integer function find_card(keyword) result(position)",
                "      character(*), intent(in) :: keyword !! keyword without the star", "      character(len(cards%key)) :: key", "      position = 0",
                "      if (len(squeeze(keyword)) > len(key)) return", "      key = squeeze(keyword)", "      do position = 1, size(cards)",
                "         if (cards(position)%key == key) return", "      end do", "      position = 0", "   end function find_card")
    yield from ("   !> Writes all lines about a word of decks, or about a word of other programs; case and blanks do not matter.", "   subroutine write_topic(unit, topic, foreign, found)",
                "      integer, intent(in) :: unit !! connected for formatted writing", "      character(*), intent(in) :: topic !! without star for a foreign card",
                "      logical, intent(in) :: foreign !! true: the words that decks do not have", "      logical, intent(inout) :: found !! true: a line was written",
                "      if (foreign) then")
    yield from (f"         call take({quoted('|'.join(words))}, {quoted(before)}//topic, {quoted(behind)})" for words, before, behind in lines if behind)
    yield "      else"
    yield from (f"         call take({quoted('|'.join(words))}, {quoted(line)}, '')" for words, line, behind in lines if behind is None and words)
    yield from ("      end if", "   contains", "      subroutine take(words, line, answer)", "         character(*), intent(in) :: words, line, answer",
                "         if (word_index(words, topic) == 0) return", "         write (unit, '(a)') line//answer", "         found = .true.", "      end subroutine take",
                "   end subroutine write_topic")
    yield from ("   !> Writes the section of one card of the reference, as Markdown.", "   subroutine write_card(unit, keyword)",
                "      integer, intent(in) :: unit !! connected for formatted writing", "      character(*), intent(in) :: keyword !! as the table spells it",
                "      select case (keyword)")
    for card in cards:
        yield f"      case ({quoted(card['keyword'])})"
        yield from printed(section(card))
    yield from ("      end select", "   end subroutine write_card", "   !> Writes the reference: an index, then all sections.",
                "   subroutine write_card_manual(unit)", "      integer, intent(in) :: unit")
    index = [f"[`*{card['keyword']}`](#{card['keyword'].lower().replace(' ', '-')})," for card in cards]
    yield from printed(["Cards:", *index[:-1], index[-1][:-1] + "."])
    yield from (f"      call write_card(unit, {quoted(card['keyword'])})" for card in cards)
    yield from ("   end subroutine write_card_manual", "   !> Writes the table as one JSON object, for programs that write decks.",
                "   subroutine write_card_json(unit, version)", "      integer, intent(in) :: unit", "      character(*), intent(in) :: version !! of the program")
    yield from ("      write (unit, '(a)') '{\"version\": \"'//version//'\", \"cards\": ['",)
    inner = ("most", "times")
    for card in cards:
        shown = dict(card, parameters=[{key: row[key] for key in row if key not in inner} for row in card["parameters"]],
                     lines=[dict(layout, fields=[{key: row[key] for key in row if key not in inner} for row in layout["fields"]]) for layout in card["lines"]])
        yield from printed([json.dumps(shown, ensure_ascii=False) + ("" if card is cards[-1] else ",")])
    yield from ("      write (unit, '(a)') ']}'", "   end subroutine write_card_json",
                "   !> Where a word comes from that decks do not have, and what to use instead, as the end of a message; '' if it is unknown.",
                "   pure function foreign_answer(kind, place, word) result(answer)", "      character(*), intent(in) :: kind  !! 'card', 'parameter', 'value' or 'field'",
                "      character(*), intent(in) :: place !! keyword of the card of a parameter or field, name of the item of a value",
                "      character(*), intent(in) :: word  !! case and blanks do not matter; number of a field", "      character(:), allocatable :: answer", "      answer = ''")
    yield from (f"      call take({quoted(kind)}, {quoted(place)}, {quoted(words)}, {quoted(answer)})" for kind, place, words, answer in foreign)
    yield from ("   contains", "      pure subroutine take(what, of, words, why)", "         character(*), intent(in) :: what, of, words, why",
                "         if (what == kind .and. (of == '' .or. of == place)) then", "            if (word_index(words, word) > 0) answer = why",
                "         end if", "      end subroutine take", "   end function foreign_answer", "end module card_table")


def main():
    cards_file, output = map(pathlib.Path, sys.argv[1:])
    modules = sorted((cards_file.parent.parent / "model").glob("*.f90"))
    model = "".join(re.sub(r"'// *&\s*&? *'", "", module.read_text(encoding="utf-8")) for module in modules)
    constants = {"@" + name: words for name, words in re.findall(r"character\(\*\), parameter :: (\w+_words) = '([^']*)'", model)}
    output.write_text("\n".join(module(*read(cards_file, constants))) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
