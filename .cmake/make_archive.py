#!/usr/bin/env python3
"""Writes run_archive.f90: procedures that put all components of the types of a run into an archive, or take them out of it.

usage: make_archive.py SOURCES OUTPUT        (CMake calls it)

Fortran has no way to go through the components of a type. So that none can be forgotten, the procedures are made from the definitions
of the types in SOURCES: for the roots below and for whatever they are made of. One procedure does both ways, see archive.f90. Pointers are
left out: what they point to belongs to somebody else.
"""
import hashlib
import pathlib
import re
import sys

ROOTS = ("path_state:path_state_t", "problem:problem_t", "path_outcome:outcome_t", "increment_trials:attempt_t", "path_record:buckling_t", "critical_points:critical_points_t", "model:model_t",
         "limit_search:curve_trace_t")
# Large, and the same in many places: stored once.
SHARED = {"model_t", "layout_t", "numbering_t", "tie_pattern_t", "candidates_t", "coupling_t", "ground_t", "load_t", "geometry_t", "step_t",
          "tableau_t", "system_t", "problem_t", "obstacle_t", "mesh_t", "state_t", "ge_stiffness_t"}
# Made again from the problem by the first use after a restart: left out.
DERIVED = {"enriched_problem_t"}
SIMPLE = {"integer": "integers", "real(wp)": "reals", "logical": "logicals"}


def statements(path):
    """Statements of a source file, one each, without comments, in small letters."""
    whole = ""
    for line in path.read_text(encoding="utf-8").splitlines():
        line = re.sub(r"'[^']*'", lambda text: text.group().replace("!", " "), line)
        line = line.split("!")[0].strip()
        if not line:
            continue
        whole += line.lstrip("&").rstrip("&") if whole else line.rstrip("&")
        if not line.endswith("&"):
            yield whole.lower()
            whole = ""


def read(sources):
    """Modules: the types that they define (components, what they extend) and where the names come from that they use."""
    modules = {}
    for path in sorted(pathlib.Path(sources).rglob("*.f90")):
        module, current, bindings = None, None, False
        for text in statements(path):
            if found := re.fullmatch(r"module (\w+)", text):
                module = modules.setdefault(found[1], {"types": {}, "uses": {}})
            elif module is None:
                continue
            elif current is None and (found := re.match(r"use (?:, intrinsic ::)? ?(\w+), only: (.*)", text)):
                for name in found[2].split(","):
                    module["uses"][name.split("=>")[0].strip()] = found[1]
            elif current is None and (found := re.fullmatch(r"type(?: ?, ?([^:]*?))? ?(?:::)? ?(\w+)", text)):
                parent = re.search(r"extends\((\w+)\)", found[1] or "")
                current = module["types"][found[2]] = {"components": [], "parent": parent and parent[1], "abstract": "abstract" in (found[1] or "")}
                bindings = False
            elif current is not None:
                if text.startswith("end type"):
                    current = None
                elif text == "contains":
                    bindings = True
                elif not bindings and "::" in text and not text.startswith("procedure"):
                    current["components"].append(text)
    return modules


def split(text):
    """At commas outside of brackets."""
    parts, depth = [""], 0
    for letter in text:
        depth += (letter in "([") - (letter in ")]")
        if letter == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += letter
    return [part.strip() for part in parts]


def left_out(declared):
    """True for components that are not archived, from the text before their names."""
    return "pointer" in declared or any(f"type({name})" in declared for name in DERIVED)


class Writer:
    def __init__(self, modules):
        self.modules, self.done, self.order, self.text = modules, {}, [], []

    def home(self, name, module):
        """The module that defines a type that `module` knows."""
        while name not in self.modules[module]["types"]:
            module = self.modules[module]["uses"][name]
        return module

    def local(self, name, module):
        """Its name in the archive: types of two modules may have the same."""
        return self.done[(self.home(name, module), name)]

    def visit(self, name, module):
        key = (self.home(name, module), name)
        if key in self.done:
            return
        taken = {local for local in self.done.values()}
        self.done[key] = name if name not in taken else f"{key[0]}_{name}"
        self.order.append(key)
        definition = self.modules[key[0]]["types"][name]
        if definition["parent"]:
            self.visit(definition["parent"], key[0])
        for component in definition["components"]:
            declared = component.split("::")[0]
            if left_out(declared):
                continue
            for inner in re.findall(r"(?:type|class)\((\w+)\)", declared):
                self.visit(inner, key[0])

    def procedure(self, key):
        module, name = key
        local = self.done[key]
        definition = self.modules[module]["types"][name]
        if definition["abstract"]:
            return []
        shared = name in SHARED
        body, inner = [], []
        if definition["parent"] and not self.modules[self.home(definition["parent"], module)]["types"][definition["parent"]]["abstract"]:
            raise SystemExit(f"make_archive.py: {name} extends a type that is not abstract")
        for component in definition["components"]:
            declared, names = component.split("::")
            words = split(declared)
            kind, more = words[0], words[1:]
            if left_out(declared):
                continue
            dimension = next((word[10:-1] for word in more if word.startswith("dimension(")), "")
            for part in split(names):
                found = re.match(r"(\w+) ?(?:\((.*?)\))? ?(?:=.*)?$", part)
                shape = found[2] or dimension
                body += self.component(kind, f"x%{found[1]}", shape, "allocatable" in more, module, inner)
        depth = max([0, *inner])
        out = [f"   recursive subroutine exchange_{local}(a, x)", "      type(archive_t), intent(inout) :: a", f"      type({local}), intent(inout) :: x"]
        if depth:
            out.append("      integer :: " + ", ".join(f"i{k}" for k in range(1, depth + 1)))
        if any("present_here" in line for line in body):
            out.append("      logical :: present_here")
        if shared:
            out += ["      integer :: mark", "      call archive_begin_shared(a, mark)"]
        out += body
        if shared:
            out.append("      call archive_end_shared(a, mark)")
        if len(out) == 3:
            raise SystemExit(f"make_archive.py: {name} has no components")
        return [*out, f"   end subroutine exchange_{local}", ""]

    def component(self, kind, name, shape, allocatable, module, inner):
        rank = len(split(shape)) if shape else 0
        if kind == "character(:)":
            return [f"      call archive_text(a, {name})"]
        if kind.startswith("class("):  # of the declared type, always
            kind = "type" + kind[5:]
        text_length = kind[10:-1] if kind.startswith("character(") else None
        simple = SIMPLE.get(kind) or ("text" if text_length and not rank else None)
        if not simple and not kind.startswith("type("):
            raise SystemExit(f"make_archive.py: no rule for {kind} {name}")
        out = []
        if allocatable:
            out += [f"      present_here = allocated({name})", "      call archive_flag(a, present_here)", "      if (a%loading) then",
                    f"         if (allocated({name})) deallocate ({name})", "      end if"]
            if rank:
                out += ["      bounds = 0"]
                out += [f"      if (present_here .and. .not. a%loading) bounds(:{rank}, 1) = lbound({name})",
                        f"      if (present_here .and. .not. a%loading) bounds(:{rank}, 2) = ubound({name})",
                        f"      if (present_here) call archive_bounds(a, {rank}, bounds)"]
                colons = ", ".join(f"bounds({k}, 1):bounds({k}, 2)" for k in range(1, rank + 1))
                out += [f"      if (present_here .and. a%loading) allocate ({name}({colons}))"]
            else:
                out += [f"      if (present_here .and. a%loading) allocate ({name})"]
            condition = "      if (present_here) "
        else:
            condition = "      "
        if simple:
            if rank:
                return [*out, f"{condition}call archive_{simple}(a, size({name}), {name})"]
            return [*out, f"{condition}call archive_one(a, {name})"]
        local = self.local(kind[5:-1], module)
        if not rank:
            return [*out, f"{condition}call exchange_{local}(a, {name})"]
        inner.append(rank)
        index = ", ".join(f"i{k}" for k in range(1, rank + 1))
        loop = []
        for k in range(rank, 0, -1):
            loop.append(f"      do i{k} = lbound({name}, {k}), ubound({name}, {k})")
        loop.append(f"         call exchange_{local}(a, {name}({index}))")
        loop += ["      end do"] * rank
        if allocatable:
            loop = ["      if (present_here) then", *loop, "      end if"]
        return [*out, *loop]

    def module_text(self):
        for root in ROOTS:
            module, name = root.split(":")
            self.visit(name, module)
        procedures = []
        for key in self.order:
            lines = self.procedure(key)
            if any("bounds" in line for line in lines):
                lines.insert(3, "      integer :: bounds(7, 2)")
            procedures += lines
        uses = []
        for module, name in sorted(self.order):
            local = self.done[(module, name)]
            if self.modules[module]["types"][name]["abstract"]:
                continue
            uses.append(f"   use {module}, only: {name}" if local == name else f"   use {module}, only: {local} => {name}")
        roots = [f"exchange_{self.local(root.split(':')[1], root.split(':')[0])}" for root in ROOTS]
        layout = hashlib.sha256("\n".join(["words", *procedures]).encode()).hexdigest()[:16]
        return "\n".join([
            "!> Made by .cmake/make_archive.py from the definitions of the types; not to be edited.", "module run_archive",
            "   use archive, only: archive_t, archive_one, archive_integers, archive_reals, archive_logicals, &",
            "      & archive_text, archive_flag, archive_bounds, archive_begin_shared, archive_end_shared", *uses,
            "   implicit none", "   private", "   public :: archive_layout, " + ", &\n      & ".join(roots), "",
            "   !> Another one where any type or the form of the archive is another one.", f"   character(*), parameter :: archive_layout = '{layout}'", "", "contains", "", *procedures, "end module run_archive", ""])


def main():
    sources, output = sys.argv[1:]
    text = Writer(read(sources)).module_text()
    output = pathlib.Path(output)
    if not output.exists() or output.read_text(encoding="utf-8") != text:
        output.write_text(text, encoding="utf-8")


main()
