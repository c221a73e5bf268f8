"""What holds for all tests: the user's own state folder is never touched, and `make test` runs several at a time."""

from collections.abc import Iterator

import pytest

ONE_AT_A_TIME = ("conformance", "interop", "missions")
"""Folders whose tests use UDP ports of their own, or share an autopilot: each is one worker's (pytest-xdist)."""


def pytest_itemcollected(item: pytest.Item) -> None:
    """Keep the tests of such a folder on one worker; all others go wherever there is room."""
    if (folder := item.path.parent.name) in ONE_AT_A_TIME:
        item.add_marker(pytest.mark.xdist_group(folder))


@pytest.fixture(scope="session", autouse=True)
def state_folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """`sitl-emu launch` without --state keeps its files in a temporary folder."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_STATE_HOME", str(tmp_path_factory.mktemp("state")))
        yield
