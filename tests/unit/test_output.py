"""Standard output that nobody reads ends nothing."""

import io
import os
import sys
from pathlib import Path

import pytest

from sitl_emu.run import output


@pytest.mark.parametrize("buffering", [1, -1])
def test_a_full_disk_under_the_output_ends_nothing(monkeypatch: pytest.MonkeyPatch, buffering: int) -> None:
    with Path("/dev/full").open("w", buffering=buffering) as full:
        monkeypatch.setattr(sys, "stdout", full)
        console = output.console()
        for _ in range(3):
            console.print("a line")


def test_a_reader_that_has_gone_ends_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    read, write = os.pipe()
    os.close(read)
    with os.fdopen(write, "w") as pipe:
        monkeypatch.setattr(sys, "stdout", pipe)
        for _ in range(3):
            output.console().print("a line")


def test_without_standard_output_nothing_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdout", None)
    output.console().print("a line")


def test_what_the_locale_has_no_letter_for_is_a_question_mark() -> None:
    written = io.BytesIO()
    file = io.TextIOWrapper(written, "ascii")
    output.Output(file).write("3 × – ok\n")
    file.flush()
    assert written.getvalue() == b"3 ? ? ok\n"
