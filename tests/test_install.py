"""What `cmake --install` and the Debian package bring, run from where they were put: program, commands, manual, man pages, completion.

UNILAT names the program, in its build folder.
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).parent.parent
BUILD = pathlib.Path(os.environ["UNILAT"]).parent
DECK = """*PARAMETER
P = 1
*NODE
1, 0, 0
2, 1, 0
*LINE, ELSET=ROD, TYPE=GE8
1, 2, 2
*BEAM SECTION, ELSET=ROD, SECTION=STIFFNESS
1e6, 1
*BOUNDARY
1, ENCASTRE
*MONITOR, NAME=tip
2, U2
*STEP
*STATIC, METHOD=LOAD
1
*CLOAD
2, 2, ${P}
*END STEP
"""

pytestmark = pytest.mark.skipif(not (BUILD / "cmake_install.cmake").exists(), reason="the program is not in a build folder")


def tried(prefix: pathlib.Path, folder: pathlib.Path):
    """Everything that was installed works from there, and nothing else is used."""
    environment = {"PATH": f"{prefix}/bin:/usr/bin:/bin", "UNILAT_PYTHON": sys.executable, "HOME": str(folder), "MPLBACKEND": "Agg",
                   "OPENBLAS_NUM_THREADS": "1", "PYTHONDONTWRITEBYTECODE": "1"}

    def run(*words, code=0):
        done = subprocess.run(words, cwd=folder, env=environment, capture_output=True, text=True, timeout=60, check=False)
        assert done.returncode == code, done.stdout + done.stderr
        return done.stdout

    (folder / "rod.inp").write_text(DECK)
    (folder / "rods.toml").write_text('deck = "rod.inp"\n[grid]\nP = [1, 2]\n[gather]\ntip = "last tip"\n')
    assert "Path complete" in run("unilat", "rod.inp")
    assert "tip" in run("unilat-plot", "csv", "rod.h5", "-o", "-")
    assert "2 of 2 runs complete" in run("unilat-sweep", "run", "rods.toml", "-j", "1")
    document = prefix / "share/doc/unilat"
    pages = [document / "README.md", *document.glob("manual/*.md")]
    assert len(pages) > 6
    for page in pages:
        assert all((page.parent / name).exists() for name in re.findall(r"\]\(([^)#:]+)[)#]", page.read_text(encoding="utf-8")))
    examples = document / "examples"
    for file in (ROOT / "input" / "maps").glob("*.toml"):
        exact = re.search(r'^exact = "(.*[.]csv)"', file.read_text(), re.MULTILINE)
        assert (examples / "maps" / file.name).exists() and (exact is None or (examples / "maps" / exact[1]).stat().st_size > 0), file
    assert not (examples / "manual").exists() and not (examples / "pictures").exists()
    assert (prefix / "share/unilat/editors/vim/syntax/unilat.vim").exists()
    for deck in ("ring", "liner", "heated-ring", "sweeps/column-random"):
        run("unilat", "--check", str(document / "examples" / f"{deck}.inp"))
    for command in ("unilat", "unilat-plot", "unilat-sweep"):
        assert (prefix / f"share/man/man1/{command}.1").exists()
        assert (prefix / f"share/bash-completion/completions/{command}").exists()
    return run


def place_in_man_page(prefix: pathlib.Path) -> list[str]:
    """Where the man page says that manual and decks are."""
    return re.findall(r"^\.I (/.*)/(?:README.md|examples)$", (prefix / "share/man/man1/unilat.1").read_text(), re.MULTILINE)


def test_install(tmp_path):
    prefix = tmp_path / "prefix"
    subprocess.run(["cmake", "--install", str(BUILD), "--prefix", str(prefix)], check=True, stdout=subprocess.DEVNULL)
    tried(prefix, tmp_path)
    assert place_in_man_page(prefix) == [f"{prefix}/share/doc/unilat"] * 2


def test_launcher_takes_a_python_with_h5py(tmp_path):
    """That beside the program first, as the package wants Debian's own; one without h5py never, however early it is on PATH."""
    prefix = tmp_path / "prefix"
    subprocess.run(["cmake", "--install", str(BUILD), "--prefix", str(prefix)], check=True, stdout=subprocess.DEVNULL)
    bare, good = tmp_path / "bare", tmp_path / "good"
    for folder, script in ((bare, "exit 1"), (good, f'[ "$1" = -c ] && exit 0; echo "$0 runs $2"')):
        folder.mkdir()
        (folder / "python3").write_text(f"#!/bin/sh\n{script}\n")
        (folder / "python3").chmod(0o755)

    def taken(**more):
        environment = {"PATH": f"{bare}:{good}:/usr/bin:/bin", "HOME": str(tmp_path), **more}
        return subprocess.run([str(prefix / "bin/unilat-plot"), "path"], env=environment, capture_output=True, text=True, timeout=60, check=False).stdout

    assert taken(PATH=f"{good}:/usr/bin:/bin") == f"{good}/python3 runs unilat\n"
    assert taken(PATH=f"{bare}:/usr/bin:/bin", UNILAT_PYTHON=str(good / "python3")) == f"{good}/python3 runs unilat\n"
    shutil.copy(good / "python3", prefix / "bin/python3")
    assert taken() == f"{prefix}/bin/python3 runs unilat\n"


@pytest.mark.skipif(not all(map(shutil.which, ("cpack", "dpkg-deb", "dpkg-shlibdeps"))), reason="no tools for Debian packages here")
def test_debian_package(tmp_path):
    made = subprocess.run(["cpack", "-G", "DEB", "-D", "CPACK_DEBIAN_COMPRESSION_TYPE=gzip", "-B", str(tmp_path / "made"), "--config", str(BUILD / "CPackConfig.cmake")],
                          capture_output=True, text=True, check=False)
    packages = list((tmp_path / "made").glob("*.deb"))
    assert made.returncode == 0 and len(packages) == 1, made.stdout + made.stderr
    told = subprocess.run(["dpkg-deb", "-f", str(packages[0]), "Package", "Depends"], capture_output=True, text=True, check=True).stdout
    assert "Package: unilat" in told and "python3-h5py" in told
    linked = subprocess.run([os.environ["UNILAT"], "--version"], capture_output=True, text=True, check=True).stdout
    assert all(any(name in told for name in names) == ("static" not in linked)
               for names in (("libgfortran",), ("libhdf5",), ("liblapack", "libopenblas")))
    subprocess.run(["dpkg-deb", "-x", str(packages[0]), str(tmp_path / "root")], check=True)
    run = tried(tmp_path / "root/usr", tmp_path)
    assert place_in_man_page(tmp_path / "root/usr") == ["/usr/share/doc/unilat"] * 2
    run("unilat", "init", "ring", "-o", "new.inp")
    if os.geteuid() == 0:       # dpkg itself, in a system of its own, which has none of the packages that this one depends on
        system = tmp_path / "system"
        for folder in ("info", "updates", "triggers"):
            (system / "var/lib/dpkg" / folder).mkdir(parents=True)
        (system / "var/lib/dpkg/status").touch()
        done = subprocess.run(["dpkg", f"--root={system}", "--force-depends", "--install", str(packages[0])], capture_output=True, text=True,
                              check=False)
        assert done.returncode == 0, done.stderr
        listed = subprocess.run(["dpkg", f"--root={system}", "-s", "unilat"], capture_output=True, text=True, check=True).stdout
        assert "Status: install ok installed" in listed and (system / "usr/bin/unilat").exists()


@pytest.mark.parametrize("recipe", ["Dockerfile", "unilat.def"])
def test_containers_install_what_a_build_and_the_pictures_need(recipe):
    """The packages of input/run, and the Python that CMake asks for."""
    needed = re.search(r'^need\(\) \{ prepare "(.*)" "(.*)"; \}', (ROOT / "input/run").read_text(), re.MULTILINE)
    words = [set(part.split()) for part in (ROOT / ".container" / recipe).read_text().split("\nFROM " if recipe == "Dockerfile" else "Stage: ")[1:]]
    assert {"python3", *needed[1].split()} <= words[0]
    if recipe == "unilat.def":      # it names what it takes of the repository
        told = re.findall(r"(?:install\(DIRECTORY|install\(FILES|GLOB_RECURSE.*PROJECT_SOURCE_DIR\}/|include\() ?\"?([.]?[a-z]+)/",
                          (ROOT / "CMakeLists.txt").read_text() + (ROOT / ".cmake/install.cmake").read_text())
        assert {".editors", "input", "postproc", "src", ".cmake"} <= set(told) <= words[0]
    assert {"python3", *(f"python3-{module}" for module in needed[2].split())} <= words[1]


def test_man_pages_name_every_option():
    said = subprocess.run([os.environ["UNILAT"], "--help"], capture_output=True, text=True, check=True).stdout
    options = set(re.findall(r"^  (--?[a-z]+)", said, re.MULTILINE))
    page = (ROOT / ".cmake/install/unilat.1.in").read_text().replace("\\-", "-")
    assert {"--set", "--expand", "-o"} <= options
    assert options == set(re.findall(r"^\.BI? (--?[a-z]+)", page, re.MULTILINE))


def completed(folder, *words) -> set[str]:
    """What the last word may become."""
    script = f'source "{ROOT}/.cmake/install/unilat.bash"; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); ' \
             'f=$(complete -p "$1"); f=${f#complete -F }; ${f% *}; printf "%s\\n" "${COMPREPLY[@]}"'
    done = subprocess.run(["bash", "-c", script, "bash", *words], cwd=folder, capture_output=True, text=True, check=True,
                          env={**os.environ, "PATH": f"{BUILD}:{os.environ['PATH']}"})
    return set(done.stdout.split())


def test_completion(tmp_path):
    for name in ("rod.inp", "rod.h5", "rods.toml", "notes.txt"):
        (tmp_path / name).write_text(DECK)
    (tmp_path / "decks").mkdir()
    assert completed(tmp_path, "unilat", "") == {"rod.inp", "decks"}
    assert completed(tmp_path, "unilat", "in") == {"init"} and completed(tmp_path, "unilat", "init", "r") == {"ring"}
    assert completed(tmp_path, "unilat", "--ch") == {"--check"} and "--set" in completed(tmp_path, "unilat", "-")
    assert completed(tmp_path, "unilat", "rod.inp", "-o", "r") == {"rod.h5"}
    assert completed(tmp_path, "unilat", "rod.inp", "--set", "") == {"P="}
    assert completed(tmp_path, "unilat-plot", "sh") == {"shape"} and completed(tmp_path, "unilat-plot", "shape", "") == {"rod.h5", "decks"}
    assert completed(tmp_path, "unilat-sweep", "run", "") == {"rods.toml", "decks"}


def test_completion_knows_every_command_of_unilat_plot():
    sys.path.insert(0, str(ROOT / "postproc"))
    from unilat.command import COMMANDS
    assert set(COMMANDS) == completed(".", "unilat-plot", "")
