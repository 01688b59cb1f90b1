"""The winches of the run: speeds that rise at a constant rate up to a bound. Used by tests, clients and driver FMU."""

RAMP = (0.3, 0.25, -0.25)
LIMIT = 1.0
STOP = 7.0
# Importers add up their steps; a corner that is a rounding error away has come.
NEAR = 1e-9


def speed(rate: float, time: float) -> float:
    """Winch speed in m/s at ``time`` in s."""
    return max(-LIMIT, min(LIMIT, rate * time))


def acceleration(rate: float, time: float) -> float:
    """Its rate just after ``time``."""
    return rate if time + NEAR < LIMIT / abs(rate) else 0.0


def winches(time: float) -> dict[str, float]:
    """What each winch does at ``time``, by the names of the driver's outputs and of the archive's connectors."""
    values = {}
    for number, rate in enumerate(RAMP, start=1):
        values[f"winch_speed_{number}"] = speed(rate, time)
        values[f"winch_acceleration_{number}"] = acceleration(rate, time)
    return values
