"""Words of Mitsuba 0.5 and 0.6 that Mitsuba 3 does not take, in its own, on the lines they were on.

``<lookAt>`` is ``<lookat>``; ``<srgb>``, the values of a screen, and ``#rrggbb`` are ``<rgb>``,
which is linear; and no colour says what it is meant for (``intent``).
"""

from __future__ import annotations

import re

TAG = re.compile(rb"<(/?)(lookAt|srgb|rgb|spectrum)\b([^<>]*)>")
VALUE = re.compile(rb"""\bvalue\s*=\s*(["'])([^"']*)\1""")
INTENT = re.compile(rb"""\s+intent\s*=\s*(["'])[^"']*\1""")
HEXADECIMAL = re.compile(rb"#([0-9a-fA-F]{6})")
SEPARATOR = re.compile(rb"[\s,]+")


def modern(text: bytes) -> bytes:
    """A scene file without old words; the same bytes where it has none.

    Examples
    --------
    >>> modern(b'<srgb name="reflectance" value="#ff0000"/>')
    b'<rgb name="reflectance" value="1.0 0.0 0.0"/>'
    """
    return TAG.sub(_tag, text)


def _tag(found: re.Match[bytes]) -> bytes:
    end, tag, rest = found.groups()
    if tag == b"lookAt":
        return b"<" + end + b"lookat" + rest + b">"
    inside = INTENT.sub(b"", rest)
    if tag == b"spectrum":
        return b"<" + end + tag + inside + b">"
    value = VALUE.search(inside)
    colour = _linear(value[2].strip(), screen=tag == b"srgb") if value else None
    if value is None or colour is None:  # Mitsuba says what is wrong with it
        return b"<" + end + tag + inside + b">"
    start, stop = value.span(2)
    return b"<" + end + b"rgb" + inside[:start] + colour + inside[stop:] + b">"


def _linear(value: bytes, screen: bool) -> bytes | None:
    """A colour as linear RGB, as it is where it is that already; None where it is no colour."""
    code = HEXADECIMAL.fullmatch(value)
    if not code and not screen:
        return value
    try:
        parts = (
            [byte / 255 for byte in bytes.fromhex(code[1].decode())]
            if code
            else [float(part) for part in SEPARATOR.split(value)]
        )
    except ValueError:
        return None
    return " ".join(repr(_light(part) if screen else part) for part in parts).encode()


def _light(value: float) -> float:
    """The light of a screen's value, both 0 to 1 (IEC 61966-2-1)."""
    return value / 12.92 if value <= 0.04045 else ((value + 0.055) / 1.055) ** 2.4
