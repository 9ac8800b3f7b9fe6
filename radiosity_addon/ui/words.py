"""Numbers in words, for panels. The templates are whole sentences, so that they translate."""

from bpy.app.translations import pgettext_iface as iface_

from .. import figures


def duration(seconds: float) -> str:
    """``3 s``, ``2 min 5 s``, ``1 h 20 min``."""
    if seconds < 1:
        return iface_("{:.2f} s").format(seconds)
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    if hours:
        return iface_("{:d} h {:d} min").format(hours, minutes)
    if minutes:
        return iface_("{:d} min {:d} s").format(minutes, rest)
    return iface_("{:d} s").format(rest)


def size(number: float) -> str:
    """Bytes as ``350 MB`` or ``1.2 GB``."""
    if number < 1e9:
        return iface_("{:.0f} MB").format(number / 1e6)
    return iface_("{:.1f} GB").format(number / 1e9)


def percent(fraction: float) -> str:
    """``2.1 %``, with two digits that count."""
    return figures.percent(fraction)


def count(number: int) -> str:
    """Thousands apart: ``1,234,567``."""
    return f"{number:,}"
