#!/usr/bin/env python3
"""Translates pFUnit test files (.pf) to Fortran with driver programs, for the test runner in this folder.

usage: pf2f90.py FOLDER tests/test_x.pf ...      writes FOLDER/test_x.f90 ..., where they change

Understands the part of pFUnit that the tests here use, and refuses the rest with file and line:
  module test_x              its name is the file's name
  @test, @disable            @disable stands after @test; then `subroutine name()` without arguments
  @before, @after            run around every test
  @assertEqual(...) etc.     on one line; the test returns after a failed assertion
"""
import re
import sys
from pathlib import Path

ASSERTIONS = {name.lower(): name for name in (
    "assertEqual", "assertRelativelyEqual", "assertTrue", "assertFalse", "assertIsFinite", "assertLessThan",
    "assertLessThanOrEqual", "assertGreaterThan", "assertGreaterThanOrEqual")}

SUBROUTINE = re.compile(r"\s*subroutine\s+(\w+)\s*(\(\s*\))?\s*(!.*)?$", re.IGNORECASE)
MODULE = re.compile(r"\s*module\s+(\w+)\s*(!.*)?$", re.IGNORECASE)
ASSERTION = re.compile(r"(\s*)@(assert\w+)\s*\((.*)\)\s*$", re.IGNORECASE)
QUOTED = re.compile(r"'[^']*'|\"[^\"]*\"")
ANNOTATION = re.compile(r"\s*@(test|disable|before|after)\s*$", re.IGNORECASE)
BEFORE_SAVE = re.compile(r"\s*(use\b|import\b|implicit\b|!|$)", re.IGNORECASE)  # statements that no `save` may precede


class Refused(Exception):
    """The file is not in the subset; the text says where and why."""


class Suite:
    """What the driver has to know about a .pf file."""

    def __init__(self):
        self.tests = []        # (name, disabled)
        self.before = None
        self.after = None


def translate(source, file_name):
    """Returns the Fortran lines of the module, and its Suite."""
    suite = Suite()
    lines = [f'# 1 "{file_name}"']  # line marker: the compiler then speaks of the .pf file
    pending = []                    # annotations that wait for their subroutine
    module = None
    base = Path(file_name).name
    # A test is called once, and its variables are static: the compiler then writes nothing that releases all components of a
    # problem at its end, which took most of the time to compile it.
    wants_save = False
    continued = False               # the line before ends with &

    for number, line in enumerate(source.splitlines(), start=1):
        def refuse(why):
            raise Refused(f"{file_name}:{number}: {why}")

        if not line.lstrip().startswith("@"):
            found = MODULE.match(line)
            if found and module is None:
                module = found[1]
                if module != Path(file_name).stem:
                    refuse(f"module {module} must be called {Path(file_name).stem}, as the file is")
            if pending and line.strip() and not line.lstrip().startswith("!"):
                found = SUBROUTINE.match(line)
                if not found:
                    refuse(f"@{pending[0]} must be followed by a subroutine without arguments")
                enlist(suite, pending, found[1].lower(), refuse)
                wants_save = pending[0] == "test"
                pending = []
            elif wants_save and not continued and not BEFORE_SAVE.match(line):
                line = f"save; {line.lstrip()}"
                wants_save = False
            continued = line.split("!")[0].rstrip().endswith("&")
            lines.append(line)
            continue

        found = ANNOTATION.match(line)
        if found:
            word = found[1].lower()
            if word in pending:
                refuse(f"@{word} stands twice before one subroutine")
            if word == "disable" and "test" not in pending:
                refuse("@disable stands after @test")
            if word != "disable" and pending:
                refuse(f"@{word} and @{pending[0]} before one subroutine")
            pending.append(word)
            lines.append("")
            continue

        found = ASSERTION.match(line)
        if not found:
            refuse("not understood; an assertion stands on one line, without a comment behind it")
        indent, name, arguments = found.groups()
        if "!" in QUOTED.sub("", arguments):
            refuse("no comment behind an assertion")
        if name.lower() not in ASSERTIONS:
            refuse(f"@{name} is not one of " + ", ".join("@" + n for n in ASSERTIONS.values()))
        if pending:
            refuse(f"@{pending[0]} must be followed by a subroutine without arguments")
        wants_save = False
        # The call stands on the line number of the assertion; what follows is the tail of the same line.
        lines += [f"{indent}call {ASSERTIONS[name.lower()]}({arguments}, location=source_location('{base}', {number}))",
                  f"{indent}if (funit_failed()) return",
                  f'# {number + 1} "{file_name}"']

    if pending:
        raise Refused(f"{file_name}: @{pending[0]} at the end of the file")
    if module is None:
        raise Refused(f"{file_name}: no module in it")
    if not suite.tests:
        raise Refused(f"{file_name}: no @test in it")
    return lines, suite


def enlist(suite, annotations, name, refuse):
    """Notes the subroutine `name` under its annotations."""
    kind = annotations[0]
    if kind == "test":
        if any(name == other for other, _ in suite.tests):
            refuse(f"test {name} stands twice")
        suite.tests.append((name, "disable" in annotations))
    elif getattr(suite, kind):
        refuse(f"a second @{kind}")
    else:
        setattr(suite, kind, name)


def driver(name, suite):
    """The program that runs the tests of one suite."""
    lines = ["", f"program {name}_driver",
             "   use funit_report, only: begin_suite, end_suite, begin_test, end_test, skip_test, funit_failed",
             f"   use {name}", "   implicit none", f"   call begin_suite('{name}')"]
    for test, disabled in suite.tests:
        if disabled:
            lines.append(f"   call skip_test('{test}')")
            continue
        lines.append(f"   call begin_test('{test}')")
        if suite.before:
            lines.append(f"   call {suite.before}()")
        lines.append(f"   if (.not. funit_failed()) call {test}()")
        if suite.after:
            lines.append(f"   call {suite.after}()")
        lines.append("   call end_test()")
    return lines + ["   call end_suite()", f"end program {name}_driver"]


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    folder, *sources = map(Path, sys.argv[1:])
    for source in sources:
        try:
            lines, suite = translate(source.read_text(encoding="utf-8"), str(source))
        except Refused as refusal:
            sys.exit(f"pf2f90: {refusal}")
        text = "\n".join(lines + driver(source.stem, suite)) + "\n"
        target = folder / f"{source.stem}.f90"
        if not target.exists() or target.read_text(encoding="utf-8") != text:  # else what depends on it is left alone
            target.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
