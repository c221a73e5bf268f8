"""Outlines as a text, for events: "latitude longitude" in degrees, "; " between corners, " | " between rings."""

from collections.abc import Sequence

LatLon = tuple[float, float]


def as_text(rings: Sequence[Sequence[LatLon]]) -> str:
    """Of rings of corners in degrees."""
    return " | ".join("; ".join(f"{lat:.7f} {lon:.7f}" for lat, lon in ring) for ring in rings)


def rings_of(text: str) -> list[list[LatLon]]:
    """The rings of `as_text`."""
    return [[_corner(each) for each in ring.split("; ")] for ring in text.split(" | ") if ring]


def _corner(text: str) -> LatLon:
    lat, lon = text.split(" ")
    return float(lat), float(lon)
