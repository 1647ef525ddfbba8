#!/usr/bin/env python3
"""Writes card_table.f90: the table of cards for checks and readers, its reference as Markdown and JSON, and foreign words.

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
           "words": constants.get(values, values).split("|") if has_words else [], "constant": values[1:] if values[0:1] == "@" else "",
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


def item_call(row, siblings):
    words = row["constant"] or quoted("|".join(row["words"]))
    times = 1 + [other["name"] for other in siblings].index(row["times"]) if row["times"] else 0
    return (f"      call add_item(t, {quoted(row['name'])}, {KINDS[row['kind']]}, .{str(row['required']).lower()}., {quoted(row['default'])}, {words}, "
            f"{quoted(row['only'])}, {BOUNDS[row['bound']]}, {row['most'] or 'usual_most'}, {times}, {quoted(row['meaning'])})")


def module(cards, foreign):
    """Lines of the Fortran module."""
    yield from ("!> The cards of src/deck/cards.txt: entries of the table, and the reference. Made by .cmake/make_cards.py.", "module card_table",
                "   use card_spec", "   use text, only: word_index", "   use model, only: method_words, parameter_words", "   implicit none", "   private",
                "   public :: all_cards, cards_of, write_card, write_card_manual, write_card_json, foreign_answer", "contains", "   !> The whole table, in the order of the manual.",
                "   pure function all_cards() result(table)", "      type(card_spec_t), allocatable :: table(:)", "      table = cards_of('')",
                "   end function all_cards", "   !> The part of the table with some cards only: a run needs few of them.", "   pure function cards_of(keys) result(table)",
                "      character(*), intent(in) :: keys !! keywords in capitals without blanks, between bars, with a bar at both ends; '': all cards",
                "      type(card_spec_t), allocatable :: table(:)", "      type(table_t) :: t", "      call begin_table(t, keys)")
    yield from (f"      if (is_wanted(t, {quoted(card['keyword'].replace(' ', ''))})) call card_{n}(t)" for n, card in enumerate(cards))
    yield from ("      call end_table(t, table)", "   end function cards_of")
    for n, card in enumerate(cards):
        yield from (f"   pure subroutine card_{n}(t)", "      type(table_t), intent(inout) :: t")
        yield (f"      call add_card(t, {quoted(card['keyword'])}, {PARTS[card['where']]}, .{str(card['once']).lower()}., .{str(card['free_text']).lower()}., "
               f"{quoted(card['follows'])}, {len(card['parameters'])}, {len(card['lines'])})")
        yield from (item_call(row, card["parameters"]) for row in card["parameters"])
        for layout in card["lines"]:
            yield (f"      call add_layout(t, {quoted(layout['when'])}, {layout['least']}, {layout.get('most', 'many_lines')}, "
                   f".{str(layout['last_repeats']).lower()}., {len(layout['fields'])})")
            yield from (item_call(row, layout["fields"]) for row in layout["fields"])
        yield f"   end subroutine card_{n}"
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
    inner = ("constant", "most", "times")
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
    model = re.sub(r"'// *&\s*&? *'", "", (cards_file.parent.parent / "model" / "model.f90").read_text(encoding="utf-8"))
    constants = {"@" + name: words for name, words in re.findall(r"character\(\*\), parameter :: (\w+_words) = '([^']*)'", model)}
    output.write_text("\n".join(module(*read(cards_file, constants))) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
