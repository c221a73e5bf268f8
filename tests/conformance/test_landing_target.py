"""LANDING_TARGET: taken in silence in MAV_FRAME_LOCAL_NED, refused with a text in another frame."""

from typing import Any

import pytest

LOCAL_NED, BODY_FRD = 1, 12
VALID = 1


@pytest.mark.covers("LANDING_TARGET", source="https://mavlink.io/en/services/landing_target.html")
@pytest.mark.covers("LANDING_TARGET", source="https://docs.px4.io/v1.18/en/advanced_features/precland")
def test_only_local_ned_is_supported(station: Any) -> None:
    level = (1.0, 0.0, 0.0, 0.0)
    for frame, refused in ((LOCAL_NED, False), (BODY_FRD, True)):
        station.mav.landing_target_send(0, 0, frame, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 2.0, 0.0, level, 0, VALID)
        texts = [message.text for message in station.collect("STATUSTEXT", 1.0)]
        assert any(f"frame {frame} unsupported" in text for text in texts) is refused
