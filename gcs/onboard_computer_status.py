"""What a companion computer says of itself: how hot its board is, of which PX4 warns (COM_CC_TEMP_WARN).

Source: https://mavlink.io/en/messages/common.html#ONBOARD_COMPUTER_STATUS. All else is told as unknown.
"""

from sitl_emu.core import dialect as mavlink

UNKNOWN_BYTE, UNKNOWN_TEMPERATURE, UNKNOWN_SPEED, UNKNOWN_SIZE = 0xFF, 127, 0x7FFF, 0xFFFFFFFF
LINK_TYPES, STORAGES = 6, 4


def board_temperature(time_us: int, uptime_ms: int, board_c: int) -> mavlink.MAVLink_message:
    """The temperature of the board, in whole degrees."""
    storage, link = (UNKNOWN_SIZE,) * STORAGES, (UNKNOWN_SIZE,) * LINK_TYPES
    return mavlink.MAVLink_onboard_computer_status_message(
        time_us,
        uptime_ms,
        0,
        cpu_cores=(UNKNOWN_BYTE,) * 8,
        cpu_combined=(UNKNOWN_BYTE,) * 10,
        gpu_cores=(UNKNOWN_BYTE,) * 4,
        gpu_combined=(UNKNOWN_BYTE,) * 10,
        temperature_board=board_c,
        temperature_core=(UNKNOWN_TEMPERATURE,) * 8,
        fan_speed=(UNKNOWN_SPEED,) * 4,
        ram_usage=UNKNOWN_SIZE,
        ram_total=UNKNOWN_SIZE,
        storage_type=storage,
        storage_usage=storage,
        storage_total=storage,
        link_type=link,
        link_tx_rate=link,
        link_rx_rate=link,
        link_tx_max=link,
        link_rx_max=link,
    )
