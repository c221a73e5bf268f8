"""What a flight of the disaster mission tells: events for log, score and report, STATUSTEXT for a ground station."""

import math
from collections.abc import Callable, Mapping, Sequence

from sitl_emu.gcs.statustext import WARNING
from sitl_emu.missions.companion.area import Corner
from sitl_emu.missions.companion.coverage import Line
from sitl_emu.missions.companion.onboard import Onboard
from sitl_emu.missions.companion.terrain.survey import Survey
from sitl_emu.missions.disaster import places
from sitl_emu.missions.disaster.aborts import Aborted
from sitl_emu.missions.disaster.alarms import Alarm
from sitl_emu.missions.disaster.outlines import as_text
from sitl_emu.missions.disaster.places import Place
from sitl_emu.missions.disaster.regions import RegionMap
from sitl_emu.missions.disaster.settings import Settings
from sitl_emu.missions.disaster.sightings import Sighting

InDegrees = Callable[[Corner], Corner]
"""From metres north and east of home to latitude and longitude."""


def plan(onboard: Onboard, settings: Settings, lines_m: Sequence[Line], deg: InDegrees) -> None:
    """The area and the lines over it, for the score and the map."""
    lines = [[deg(end) for end in line] for line in lines_m]
    area = as_text([settings.corners_deg, *settings.holes_deg])
    altitude_m = settings.scan_altitude_m
    onboard.note("plan", f"{len(lines)} lines", area=area, lines=as_text(lines), scan_altitude_m=altitude_m)


def target(
    onboard: Onboard,
    place: Place,
    number: int,
    height_m: float,
    ground_sigma_m: float,
    deg: InDegrees,
    seen: Mapping[str, float | int],
) -> None:
    """The line is left for a place. `height_m`: of the camera above the ground; `seen`: frame and box that show it."""
    eph_m = onboard.telemetry.eph_m or 0.0
    edge_deg, place_deg = deg(place.edge_m), deg(place.place_m)
    onboard.say(f"Target: {place.label}, score {place.score:.2f}, {place.area_m2:.0f} m2 seen")
    onboard.note(
        "target_confirmed",
        f"target {number}: {place.label}",
        target=number,
        label=place.label,
        score=round(place.score, 3),
        located="middle" if place.is_middle else "edge",
        lat_deg=edge_deg[0],
        lon_deg=edge_deg[1],
        place_lat_deg=place_deg[0],
        place_lon_deg=place_deg[1],
        sigma_m=round(places.sigma_m(place, height_m, ground_sigma_m, eph_m), 3),
        area_m2=round(place.area_m2, 1),
        **seen,
    )


def sighting(onboard: Onboard, one: Sighting, deg: InDegrees) -> None:
    """A region, as one frame places it."""
    lat_deg, lon_deg = deg(one.place_m)
    text = f"{one.label}, by one frame"
    onboard.note("sighting", text, label=one.label, score=round(one.score, 3), lat_deg=lat_deg, lon_deg=lon_deg)


def goes_on(onboard: Onboard, place: Place, before: Place) -> None:
    """Low over a place that is none any more it goes on to another."""
    away_m = math.dist(place.place_m, before.place_m)
    onboard.note("place_changed", f"seen from low: to a place {away_m:.1f} m on", away_m=round(away_m, 2))


def releases(onboard: Onboard, place: Place, here_m: Corner, height_m: float, deg: InDegrees) -> None:
    """The parcel is let go, `height_m` above the ground."""
    place_deg, here_deg = deg(place.place_m), deg(here_m)
    wind = onboard.telemetry.wind
    onboard.note(
        "released",
        f"parcel let go from {height_m:.1f} m, to lie {place.where}",
        label=place.label,
        lat_deg=here_deg[0],
        lon_deg=here_deg[1],
        place_lat_deg=place_deg[0],
        place_lon_deg=place_deg[1],
        height_m=round(height_m, 2),
        wind_known=int(wind is not None),
        wind_north_m_s=round(wind.north_m_s, 2) if wind else 0.0,
        wind_east_m_s=round(wind.east_m_s, 2) if wind else 0.0,
    )


def lies(onboard: Onboard, lies_m: Corner | None, place_m: Corner, deg: InDegrees) -> None:
    """Where the camera sees the parcel lie; None where it does not."""
    if lies_m is None:
        onboard.say("Parcel not seen on the ground", WARNING)
        onboard.note("parcel_unseen", "the camera does not see the parcel")
        return
    lat_deg, lon_deg = deg(lies_m)
    text = f"Parcel seen {math.dist(lies_m, place_m):.1f} m from its place"
    onboard.say(text)
    onboard.note("parcel_seen", text, lat_deg=lat_deg, lon_deg=lon_deg)


def aborted(onboard: Onboard, why: Aborted, *, delivered: bool) -> None:
    """Why the parcel stays on board; of one that was `delivered`, why the scan ends."""
    stays = "" if delivered else "; the parcel stays on board"
    onboard.say(f"Aborted: {why}{stays}", WARNING)
    kind = "scan_aborted" if delivered else "delivery_aborted"
    onboard.note(kind, str(why), reason=str(why.reason))


def terrain_map(onboard: Onboard, name: str, survey: Survey, ground: tuple[float, float, float]) -> None:
    """How much was kept under a name; `ground`: latitude, longitude and height AMSL of the ground at home."""
    onboard.note(
        "terrain_map",
        f"{name}: {survey.features} corners, {survey.ranges} ranges",
        file=name,
        features=survey.features,
        ranges=survey.ranges,
        home_lat_deg=ground[0],
        home_lon_deg=ground[1],
        home_amsl_m=ground[2],
    )


def alarms(onboard: Onboard, found: Sequence[Alarm], deg: InDegrees) -> None:
    """Where detections alone would have called it, and when, for the score."""
    for frames, label in sorted({(one.frames, one.label) for one in found}):
        those = [one for one in found if (one.frames, one.label) == (frames, label)]
        text = f"{label} in {frames} frame{'s in a row' if frames > 1 else ''}: {len(those)} places"
        times_s = " ".join(f"{one.time_us / 1e6:.2f}" for one in those)
        places = as_text([[deg(one.place_m) for one in those]])
        onboard.note("alarms", text, frames=frames, label=label, times_s=times_s, places=places)


def regions(onboard: Onboard, found: RegionMap, deg: InDegrees) -> None:
    """All that was found, with outlines, for the score and the map."""
    for number, region in enumerate(found.regions(), 1):
        lat_deg, lon_deg = deg(region.middle_m)
        rings = [[deg(corner) for corner in ring] for ring in found.outlines(region)]
        onboard.note(
            "region",
            f"{region.label}, {region.area_m2:.0f} m2",
            number=number,
            label=region.label,
            score=round(region.score, 3),
            area_m2=round(region.area_m2, 1),
            lat_deg=lat_deg,
            lon_deg=lon_deg,
            outlines=as_text(rings),
        )
