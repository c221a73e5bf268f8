"""pymavlink's own FTP client (mavftp): list, put, get by bursts of 80 bytes, crc, rename, remove."""

import random
from collections.abc import Iterator
from pathlib import Path

import pytest
from pymavlink import mavutil
from pymavlink.mavftp import MAVFTP, FtpError

from tests.launched import launched

INSTANCE = 112
RETRY_S = 0.5
IDLE_S = 0.6
"""After so long a silence mavftp holds an operation for done; it waits for it each time."""
CONTENT = random.Random(9).randbytes(60_000)


@pytest.fixture(scope="module")
def client() -> Iterator[MAVFTP]:
    """On the ground station's link of a launched vehicle."""
    with launched("iris", "--instance", str(INSTANCE)):
        link = mavutil.mavlink_connection(f"udpout:127.0.0.1:{18570 + INSTANCE}", source_system=255)
        try:
            found = None
            while found is None:
                link.mav.heartbeat_send(6, 8, 0, 0, 4)
                found = link.recv_match(type="HEARTBEAT", blocking=True, timeout=0.5)
            ftp = MAVFTP(link, target_system=INSTANCE + 1, target_component=1)
            ftp.ftp_settings.read_retry_time = ftp.ftp_settings.retry_time = RETRY_S
            ftp.ftp_settings.idle_detection_time = IDLE_S
            yield ftp
        finally:
            link.close()


def test_a_file_goes_up_and_comes_down(client: MAVFTP, tmp_path: Path) -> None:
    local, back = tmp_path / "file.bin", tmp_path / "back.bin"
    local.write_bytes(CONTENT)
    assert client.cmd_put([str(local), "/file.bin"]).error_code == FtpError.Success
    assert client.process_ftp_reply("CreateFile", timeout=30).error_code == FtpError.Success
    assert client.cmd_list(["/"]).error_code == FtpError.Success
    assert ("file.bin", False, len(CONTENT)) in [(e.name, e.is_dir, e.size_b) for e in client.list_result]
    assert client.cmd_get(["/file.bin", str(back)]).error_code == FtpError.Success
    assert client.process_ftp_reply("OpenFileRO", timeout=30).error_code == FtpError.Success
    assert back.read_bytes() == CONTENT
    assert client.cmd_rename(["/file.bin", "/other.bin"]).error_code == FtpError.Success
    assert client.cmd_crc(["/other.bin"]).error_code == FtpError.Success
    assert client.cmd_rm(["/other.bin"]).error_code == FtpError.Success
    assert client.cmd_rm(["/other.bin"]).error_code == FtpError.FileNotFound


def test_folders_are_made_and_removed(client: MAVFTP) -> None:
    assert client.cmd_mkdir(["/mavftp"]).error_code == FtpError.Success
    assert client.cmd_mkdir(["/mavftp"]).error_code == FtpError.FileExists
    assert client.cmd_rmdir(["/mavftp"]).error_code == FtpError.Success
    assert client.cmd_rmdir(["/mavftp"]).error_code == FtpError.FileNotFound
