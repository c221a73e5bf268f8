"""Feeds in shared memory: what is read is whole and in order; neither a slow reader nor a dead writer goes unseen."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitl_emu.core import frame_ring
from sitl_emu.core.frame_ring import Encoding, Format, Kind, RingError, RingReader, RingWriter, remove_if_left
from tests.typed import now

ROOT = Path(__file__).parents[2]
IMAGE = Format(Kind.IMAGE, Encoding.BGR8, 48, 64)
CLOUD = Format(Kind.POINTS, Encoding.XYZ32, 500)
FORMATS = [
    IMAGE,
    CLOUD,
    Format(Kind.IMAGE, Encoding.RGB8, 3, 5),
    Format(Kind.DEPTH, Encoding.M32, 7, 9),
    Format(Kind.DEPTH, Encoding.MM16, 7, 9),
]


@pytest.fixture
def name() -> Iterator[str]:
    name = f"sitl_emu_test_{os.getpid()}"
    yield name
    assert not Path("/dev/shm", name).exists(), "left behind"


def image(value: int) -> "np.ndarray[tuple[int, ...], np.dtype[np.uint8]]":
    return np.full(IMAGE.shape, value, np.uint8)


@pytest.mark.parametrize("what", FORMATS, ids=lambda what: what.encoding.value)
def test_a_reader_is_told_what_a_ring_carries_and_gets_it_bit_by_bit(name: str, what: Format) -> None:
    rng = np.random.default_rng(3)
    data = rng.integers(0, 200, what.shape).astype(what.encoding.dtype)
    writer = RingWriter(name, what, slots=3)
    reader = RingReader(name)
    assert reader.what == what and reader.slots == 3
    writer.write(123_456, data)
    sample = reader.read()
    assert sample is not None and sample.time_us == 123_456
    assert sample.data.dtype == what.encoding.dtype and np.array_equal(sample.data, data)
    reader.close()
    writer.close()


def test_samples_come_in_order_and_once_with_their_times(name: str) -> None:
    writer = RingWriter(name, IMAGE, slots=4)
    reader = RingReader(name)
    assert reader.read() is None
    for i in range(3):
        writer.write(1000 * i, image(i))
    samples = list(iter(reader.read, None))
    assert [(s.time_us, s.number, int(s.data[5, 5, 1])) for s in samples] == [(0, 0, 0), (1000, 1, 1), (2000, 2, 2)]
    reader.close()
    writer.close()


def test_a_cloud_has_as_many_points_as_were_written(name: str) -> None:
    writer = RingWriter(name, CLOUD)
    reader = RingReader(name)
    for count in (0, 1, 500):
        writer.write(count, np.full((count, 3), float(count), np.float32))
        cloud = reader.read()
        assert cloud is not None and cloud.data.shape == (count, 3) and np.all(cloud.data == count)
    with pytest.raises(ValueError, match="broadcast"):
        writer.write(0, np.zeros((501, 3), np.float32))
    reader.close()
    writer.close()


def test_a_slow_reader_is_told_how_many_it_lost(name: str) -> None:
    writer = RingWriter(name, IMAGE, slots=4)
    reader = RingReader(name)
    for i in range(10):
        writer.write(i, image(i))
    assert [sample.number for sample in iter(reader.read, None)] == [6, 7, 8, 9]
    assert reader.lost == 6
    assert reader.at(5) is None and reader.at(10) is None and reader.at(-1) is None
    reader.close()
    writer.close()


def test_who_wants_the_newest_alone_gets_it_once(name: str) -> None:
    writer = RingWriter(name, IMAGE, slots=4)
    reader = RingReader(name)
    for i in range(3):
        writer.write(i, image(i))
    newest = reader.newest()
    assert newest is not None and newest.number == 2 and reader.newest() is None and reader.read() is None
    reader.close()
    writer.close()


def test_a_slot_that_is_being_written_is_not_given_as_what_it_was(name: str) -> None:
    writer = RingWriter(name, IMAGE, slots=2)
    reader = RingReader(name)
    for i in range(2):
        writer.write(i, image(i))
    writer.next_data[:20] = 99
    assert reader.at(0) is None, "half of it is already the next one"
    assert [sample.number for sample in iter(reader.read, None)] == [1] and reader.lost == 1
    writer.commit(5)
    sample = reader.read()
    assert sample is not None and (sample.number, int(sample.data[0, 0, 0]), int(sample.data[40, 0, 0])) == (2, 99, 0)
    reader.close()
    writer.close()


@given(slots=st.integers(1, 5), bursts=st.lists(st.integers(0, 12), max_size=8))
def test_each_sample_is_either_read_or_counted_as_lost(slots: int, bursts: list[int]) -> None:
    writer = RingWriter(f"sitl_emu_burst_{os.getpid()}", CLOUD, slots)
    reader, read, written = RingReader(writer.name), list[int](), 0
    for burst in bursts:
        for _ in range(burst):
            writer.write(written * 10, np.full((1, 3), float(written), np.float32))
            written += 1
        for sample in iter(reader.read, None):
            assert sample.time_us == 10 * sample.number and sample.data[0, 0] == sample.number
            read.append(sample.number)
    assert read == sorted(set(read)) and len(read) + reader.lost == written
    reader.close()
    writer.close()


def test_a_reader_that_ends_leaves_the_ring_to_others(name: str) -> None:
    writer = RingWriter(name, IMAGE)
    writer.write(0, image(1))
    for _ in range(2):
        read = f"from sitl_emu.core.frame_ring import *; assert RingReader({name!r}).read() is not None"
        subprocess.run([sys.executable, "-P", "-c", read], check=True, cwd=ROOT, timeout=60)
    assert Path("/dev/shm", name).exists()
    writer.close()


def test_the_end_of_the_writer_is_seen_when_all_is_read(name: str) -> None:
    writer = RingWriter(name, IMAGE)
    writer.write(0, image(1))
    reader = RingReader(name)
    assert not now(reader.ended)
    writer.close()
    writer.close()
    assert not now(reader.ended) and reader.read() is not None and now(reader.ended)
    reader.close()
    assert now(reader.ended) and reader.read() is None and reader.at(0) is None


def test_a_ring_of_somebody_alive_is_not_taken_from_him(name: str) -> None:
    writer = RingWriter(name, IMAGE)
    with pytest.raises(RingError, match=f"shm:{name}: there is such a ring already"):
        RingWriter(name, IMAGE)
    assert not remove_if_left(name)
    writer.write(0, image(1))
    reader = RingReader(name)
    assert reader.read() is not None and not reader.ended
    reader.close()
    writer.close()


WRITER = """
import sys
import numpy as np
from sitl_emu.core.frame_ring import *
ring = RingWriter(sys.argv[1], Format(Kind.POINTS, Encoding.XYZ32, 64), slots=4)
ring.write(7, np.ones((3, 3), np.float32))
print("there", flush=True)
sys.stdin.readline()
for i in range(60000):
    ring.next_data[:] = i
    ring.commit(i)
sys.stdin.readline()
ring.close()
"""


@pytest.fixture
def writer(name: str) -> "Iterator[subprocess.Popen[str]]":
    """A process that writes a cloud, and 60000 more when it gets a line; a second line ends it."""
    command = [sys.executable, "-P", "-c", WRITER, name]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, cwd=ROOT, text=True) as process:
        assert process.stdout is not None and process.stdout.readline() == "there\n"
        yield process


def test_a_writer_that_was_killed_is_seen_and_its_ring_replaced(name: str, writer: "subprocess.Popen[str]") -> None:
    reader = RingReader(name)
    assert reader.read() is not None and not now(reader.ended)
    writer.send_signal(signal.SIGKILL)
    writer.wait(30)
    assert now(reader.ended) and Path("/dev/shm", name).exists()
    again = RingWriter(name, IMAGE)
    assert RingReader(name).what == IMAGE
    again.close()
    reader.close()
    assert remove_if_left(name), "there is none"


def test_what_a_killed_writer_left_is_removed_by_name(name: str, writer: "subprocess.Popen[str]") -> None:
    writer.kill()
    writer.wait(30)
    assert remove_if_left(name) and not Path("/dev/shm", name).exists()


def test_a_reader_beside_a_busy_writer_never_gets_a_torn_sample(name: str, writer: "subprocess.Popen[str]") -> None:
    assert writer.stdin is not None
    reader, last, whole = RingReader(name), 0, 0
    writer.stdin.write("go\n")
    writer.stdin.flush()
    while last < 60001:
        written = reader.written
        assert written >= last, "the count of samples went back"
        last = written
        if (sample := reader.newest()) is not None and sample.number:
            assert sample.time_us == sample.number - 1 and np.all(sample.data == sample.time_us), "torn"
            whole += 1
    assert whole > 10
    writer.communicate("end\n", timeout=30)
    reader.close()


def test_what_is_no_ring_is_told(name: str) -> None:
    with pytest.raises(RingError, match=r"there is no such ring of frames .*; is the simulator running"):
        RingReader(name)
    path = Path("/dev/shm", name)
    path.write_bytes(bytes(100))
    with pytest.raises(RingError, match="that shared memory is no ring of frames"):
        RingReader(name)
    path.unlink()


def test_a_ring_without_shared_memory_is_told_with_what_it_needs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(frame_ring, "FOLDER", tmp_path / "shm")
    with pytest.raises(RingError, match=r"No such file or directory; .*shm needs 1 MiB for it .*--shm-size"):
        RingWriter("any", IMAGE)
