"""What all pytest runs of this folder share."""
import os


def skipped(item):
    marker = item.get_closest_marker("skipif")
    return marker is not None and bool(marker.args[0])


def pytest_collection_modifyitems(config, items):
    """With run-time checks the first and the last of a test's parameters: the others run the same code on other numbers, which the
    optimised build sees. Not where every parameter is another deck (EVERY_PARAMETER)."""
    if os.environ.get("UNILAT_CHECKED") != "1":
        return
    tests = {}
    for item in items:
        if not (skipped(item) or getattr(item.module, "EVERY_PARAMETER", False)):
            tests.setdefault((item.path, item.originalname), []).append(item)
    left = {id(item) for same in tests.values() for item in same[1:-1]}
    config.hook.pytest_deselected(items=[item for item in items if id(item) in left])
    items[:] = [item for item in items if id(item) not in left]
