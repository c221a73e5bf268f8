"""RADIO_STATUS: what a radio tells of each link, and when it counts as gone."""

from sitl_emu.core import dialect as mavlink
from tests.unit.mavlink_peer import GCS, ONBOARD, Peer


def told(rssi: int, txbuf: int = 90) -> mavlink.MAVLink_radio_status_message:
    return mavlink.MAVLink_radio_status_message(rssi, 180, txbuf, 40, 42, 3, 7)


def test_each_link_has_its_radio_and_the_first_that_was_heard_is_the_topic() -> None:
    peer = Peer(component=mavlink.MAV_COMP_ID_TELEMETRY_RADIO)
    peer.run(1.0)
    peer.send(told(200), ONBOARD)
    peer.send(told(150), GCS)
    radios = [link.radio for link in peer.mavlink.links]
    assert [radio and radio.rssi for radio in radios] == [150, 200, None, None]
    assert peer.topics.radio_status == (peer.now_us, 200, 180, 90, 40, 42, 3, 7)


def test_a_radio_that_is_silent_for_mav_radio_tout_is_gone_and_the_log_says_so_once() -> None:
    peer = Peer(component=mavlink.MAV_COMP_ID_TELEMETRY_RADIO)
    peer.parameters.set("MAV_RADIO_TOUT", 2)
    peer.send(told(200), GCS)
    peer.run(1.0)
    peer.send(told(201), ONBOARD)
    peer.run(1.1)
    assert [link.radio is None for link in peer.mavlink.links[:2]] == [True, False]
    peer.run(3.0)
    said = [line.line for line in peer.texts.lines if "RADIO_STATUS" in line.line]
    assert said == [f"[mavlink] instance {number}: RADIO_STATUS timeout" for number in (0, 1)]
    peer.send(told(202), GCS)
    radio = peer.mavlink.links[GCS].radio
    assert radio is not None and radio.rssi == 202


def test_a_full_buffer_slows_no_stream_of_sitls_links() -> None:
    """Throttling is MAV_X_RADIO_CTL's, of serial ports."""
    peer = Peer(component=mavlink.MAV_COMP_ID_TELEMETRY_RADIO)

    def rate(txbuf: int) -> int:
        heard = []
        for _ in range(5):
            peer.send(told(200, txbuf))
            for _ in range(250):
                peer.fly()
                heard += [message.get_type() for message in peer.run(0.004)]
        return heard.count("ATTITUDE")

    assert rate(90) > 200
    assert abs(rate(0) - rate(90)) <= 2
