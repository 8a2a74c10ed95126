"""Numbers, words and names of files that no format expects, and changes of what it does expect."""

from __future__ import annotations

import random
import re

from hypothesis import strategies as st

NUMBERS = (
    *("0", "-0", "-1", "1", "2", "1e-45", "5e-324", "1e-30", "1e30", "3.5e38", "1e39", "1e308"),
    *("1e309", "-1e400", "nan", "-nan", "inf", "-inf", "Infinity", "NaN", "0x1F", "1_000", "١"),
    *("2147483647", "2147483648", "-2147483649", "4294967295", "4294967296", "1e9", "1000000000"),
    *("9223372036854775807", "18446744073709551616", "", " ", ".", "-", "1.2.3", "1,2", "1;2"),
    *("0.5 0.5", "1 2 3", "1 2 3 4", "0 0 0", "true", "None", "[]", "{}", "'", '"', "9" * 400),
    *("9" * 5000, "0." + "3" * 100_000),
)
WORDS = (
    *("", " ", "\t", "x", "..", "/", "a/b", "$", "$x", "$x$y", "${x}", "%s", "%n%n", "{}", "{0}"),
    *(
        "\\",
        "ß",
        "日本語",
        "\u202e",
        "\u0000",
        "\x7f",
        "\ud7ff",
        "\U0001f4a1",
        "a\nb",
        "A" * 10_000,
    ),
    *("__class__", "scene", "_arg_0", "type", "id", "-1", "nan", "'; --", "<b>", "&amp;", "NUL"),
)
FILES = (
    *("", ".", "..", "/", "/dev/null", "/dev/zero", "/dev/urandom", "/dev/stdin", "/dev/full"),
    *("/proc/self/mem", "/proc/self/environ", "/etc/passwd", "gone", "gone.xml", "a" * 300),
    *("a/" * 3000, "room.xml", "./room.xml", "../x", "\u00e9.xml", "a b.xml", "a\nb.xml", "a\x00b"),
    *(
        "~",
        "$HOME",
        "*",
        "-",
        "--",
        "http://localhost/a.xml",
        "file:///etc/passwd",
        "|ls",
        "a.xml ",
    ),
)
numbers, words, files = (st.sampled_from(values) for values in (NUMBERS, WORDS, FILES))
anything = numbers | words | files | st.text(max_size=20) | st.floats().map(repr)
NUMBER = re.compile(rb"-?\d+\.?\d*(?:[eE][-+]?\d+)?")
WORD = re.compile(rb"[A-Za-z_]\w*")
BYTES = (0x00, 0x01, 0x7F, 0x80, 0xFF, 0x20, 0x0A, 0x3C, 0x22)


def flipped(content: bytes, rng: random.Random) -> bytes:
    """One to eight bits, bytes or stretches changed, doubled, put in or left out."""
    changed = bytearray(content)
    for _ in range(rng.choice((1, 1, 1, 2, 3, 8))):
        # the head of a file says what the rest is
        reach = len(changed) if rng.random() < 0.5 else min(len(changed), 400)
        at = rng.randrange(reach + 1)
        some = changed[at : at + rng.choice((1, 2, 4, 8, 64, 1024))]
        how = rng.choice(("bit", "bit", "byte", "byte", "word", "cut", "out", "in", "double"))
        if how == "bit" and some:
            changed[at] ^= 1 << rng.randrange(8)
        elif how == "byte" and some:
            changed[at] = rng.choice(BYTES)
        elif how == "word":
            changed[at : at + 4] = rng.choice((b"\xff", b"\0", b"\x7f")) * 4
        elif how == "cut":
            del changed[at:]
        elif how == "out":
            del changed[at : at + len(some)]
        elif how == "in":
            changed[at:at] = rng.randbytes(len(some))
        elif how == "double":
            changed[at:at] = some * rng.choice((1, 1, 2, 100))
    return bytes(changed)


def garbled(content: bytes, rng: random.Random) -> bytes:
    """As text: one to four of its numbers, words or lines are others, twice there, or gone."""
    for _ in range(rng.choice((1, 1, 2, 4))):
        lines = content.split(b"\n")
        i, how = rng.randrange(len(lines)), rng.choice(("number", "number", "word", "line", "flip"))
        if how == "line":
            lines[i : i + 1] = [lines[i]] * rng.choice((0, 0, 2, 1000))
            content = b"\n".join(lines)
        elif how == "flip":
            content = flipped(content, rng)
        else:
            pattern, values = (NUMBER, NUMBERS) if how == "number" else (WORD, WORDS + FILES)
            found = list(pattern.finditer(content))
            if found:
                at = rng.choice(found)
                new = rng.choice(values).encode("utf-8", "surrogatepass")
                content = content[: at.start()] + new + content[at.end() :]
    return content


def changed(*contents: bytes, text: bool = False) -> st.SearchStrategy[bytes]:
    """Good contents, changed; one in twenty is left as it is."""

    def change(one: bytes, seed: int) -> bytes:
        rng = random.Random(seed)
        if rng.random() < 0.05:
            return one
        return (garbled if text and rng.random() < 0.7 else flipped)(one, rng)

    return st.builds(change, st.sampled_from(contents), st.integers(0, 2**32))
