"""Numbers and lists of names as people read them: no exponents, no digits that mean nothing, and few names."""

from __future__ import annotations

SMALLEST = 1e-3  # share [%]: smaller ones are shown as less than it
LARGEST = 1e9  # number [of any unit]: smaller ones have no exponent


def percent(share: float) -> str:
    """A share as ``2.1 %``: two digits that count, and all those before the point.

    >>> [percent(share) for share in (0.0213, 0.996, 1.0, 1.234, 0.0, 2e-6)]
    ['2.1 %', '100 %', '100 %', '123 %', '0 %', 'under 0.001 %']
    """
    value = 100 * share
    if 0 < value < SMALLEST:
        return f"under {SMALLEST:g} %"
    return f"{value:.0f} %" if value >= 10 else f"{value:.2g} %"


def figure(value: float, digits: int = 3) -> str:
    """A number rounded to ``digits`` that count, thousands apart.

    >>> [figure(value) for value in (12345.6, 297.34, 87.921, 0.5, 0.0, 2.5e12)]
    ['12,300', '297', '87.9', '0.5', '0', '2.5e+12']
    """
    rounded = float(f"{value:.{digits}g}")
    if 10**digits <= abs(rounded) < LARGEST:
        return f"{rounded:,.0f}"
    return f"{rounded:.{digits}g}"


def quoted(names, most: int = 3) -> str:
    """The first of the ``names``, ``most`` of them, and how many more there are.

    >>> quoted(["Wall"]), quoted(["Wall", "Lamp", "Door", "Roof", "Sill"])
    ("'Wall'", "'Wall', 'Lamp', 'Door' and 2 more")
    """
    text = ", ".join(repr(name) for name in list(names)[:most])
    return f"{text} and {len(names) - most} more" if len(names) > most else text
