"""Where the sun stands at a place and a time, as Mitsuba 0.6 has it (src/emitters/sunsky)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from clpt.formats.mitsuba.properties import Properties

# parameters and their defaults: Tokyo, in its summer
DATE = {"year": 2010.0, "month": 7.0, "day": 10.0, "hour": 15.0, "minute": 0.0, "second": 0.0}
PLACE = {"latitude": 35.6894, "longitude": 139.6917, "timezone": 9.0}
PARALLAX = 6371.01 / 149597890.0  # the earth's radius over the distance of the sun


def sun_direction(props: Properties) -> Any:
    """Take a date and a place; return the direction to the sun (3,), +y up, -z north, +x east."""
    date = {name: props.number(name, value) for name, value in DATE.items()}
    place = {name: props.number(name, value) for name, value in PLACE.items()}
    hours = date["hour"] - place["timezone"] + (date["minute"] + date["second"] / 60.0) / 60.0
    days = _julian_day(*(int(date[name]) for name in ("year", "month", "day")))
    return _direction(days - 0.5 + hours / 24.0 - 2451545.0, hours, place)


def _julian_day(year: int, month: int, day: int) -> int:
    early = int((month - 14) / 12)  # rounded toward zero, as in C
    months = int(367 * (month - 2 - 12 * early) / 12)
    centuries = int(3 * int((year + 4900 + early) / 100) / 4)
    return int(1461 * (year + 4800 + early) / 4) + months - centuries + day - 32075


def _direction(days: float, hours: float, place: dict[str, float]) -> Any:
    """Blanco-Muriel et al. 2001; days: since noon of 2000-01-01 in UT."""
    omega = 2.1429 - 0.0010394594 * days
    mean = 4.8950630 + 0.017202791698 * days
    anomaly = 6.2400600 + 0.0172019699 * days
    longitude = mean + 0.03341607 * math.sin(anomaly) + 0.00034894 * math.sin(2.0 * anomaly)
    longitude -= 0.0001134 + 0.0000203 * math.sin(omega)
    obliquity = 0.4090928 - 6.2140e-9 * days + 0.0000396 * math.cos(omega)
    across = math.cos(obliquity) * math.sin(longitude)
    ascension = math.atan2(across, math.cos(longitude)) % (2.0 * math.pi)
    declination = math.asin(math.sin(obliquity) * math.sin(longitude))
    sidereal = 6.6974243242 + 0.0657098283 * days + hours
    angle = math.radians(15.0 * sidereal + place["longitude"]) - ascension
    latitude = math.radians(place["latitude"])
    height = math.cos(latitude) * math.cos(angle) * math.cos(declination)
    zenith = math.acos(height + math.sin(declination) * math.sin(latitude))
    north = math.tan(declination) * math.cos(latitude) - math.sin(latitude) * math.cos(angle)
    azimuth = math.atan2(-math.sin(angle), north)
    zenith += PARALLAX * math.sin(zenith)
    level = math.sin(zenith)
    return np.array([math.sin(azimuth) * level, math.cos(zenith), -math.cos(azimuth) * level])
