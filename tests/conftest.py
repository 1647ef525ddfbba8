"""What all pytest runs of this folder share: which cases they run, and what kills a program.

With run-time checks (UNILAT_CHECKED=1) the first and the last of a test's parameters: the others run the same code on other numbers,
which the optimised build sees. Not where every parameter is another deck (EVERY_PARAMETER), and nothing that is marked
`release_only`. Where each case is to run in one build only (UNILAT_CASES=once) the first one is that of the checked build, and all
others are the optimised one's, as is all that is marked `once_in_release`."""
import os
import pathlib
import shutil
import subprocess

import pytest

CHECKED = os.environ.get("UNILAT_CHECKED") == "1"
ONCE = os.environ.get("UNILAT_CASES") == "once"
IN_BOTH_BUILDS = os.environ.get("UNILAT_LABEL") == "deck"


def pytest_configure(config):
    config.addinivalue_line("markers", "release_only: much of what smaller tests run, too long with run-time checks")
    config.addinivalue_line("markers", "once_in_release: with run-time checks only where cases run in both builds")


def skipped(item):
    marker = item.get_closest_marker("skipif")
    return marker is not None and bool(marker.args[0])


def checked_cases(items):
    """Those that run with run-time checks."""
    tests = {}
    every = set()
    for item in items:
        if skipped(item) or item.get_closest_marker("release_only") or (ONCE and item.get_closest_marker("once_in_release")):
            continue
        if getattr(item.module, "EVERY_PARAMETER", False):
            every.add(id(item))
        else:
            tests.setdefault((item.path, item.originalname), []).append(item)
    last = 1 if ONCE else 2
    return every | {id(item) for same in tests.values() for item in ([same[0], same[-1]][:last])}


def pytest_collection_modifyitems(config, items):
    if not CHECKED and not (ONCE and IN_BOTH_BUILDS):
        return
    checked = checked_cases(items)
    here = [item for item in items if (id(item) in checked) == CHECKED]
    config.hook.pytest_deselected(items=[item for item in items if item not in here])
    items[:] = here


def pytest_sessionfinish(session, exitstatus):
    """All of a file's cases may be the other build's."""
    if ONCE and exitstatus == pytest.ExitCode.NO_TESTS_COLLECTED:
        session.exitstatus = pytest.ExitCode.OK


@pytest.fixture(scope="session")
def shim(tmp_path_factory):
    """The library that kills a program at one of its writes (kill_at_write.c); with a C compiler that can make one."""
    compiler = os.environ.get("UNILAT_CC", "cc")
    library = tmp_path_factory.mktemp("shim") / "kill_at_write.so"
    if shutil.which(compiler) is None:
        pytest.skip("no C compiler here")
    source = pathlib.Path(__file__).resolve().parent / "kill_at_write.c"
    subprocess.run([compiler, "-shared", "-fPIC", "-o", str(library), str(source), "-ldl"], check=True)
    return library
