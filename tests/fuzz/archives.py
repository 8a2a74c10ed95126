"""Archives of arrays: members of good ones replaced, doubled, broken or said to be larger."""

from __future__ import annotations

import functools
import io
import random
import warnings
import zipfile

import numpy as np
from hypothesis import strategies as st

from fuzz import corpus, odd
from fuzz.inputs import Input

SHAPES = ((), (0,), (1,), (3,), (24,), (24, 1), (24, 3), (1, 3, 1), (0, 3), (2, 2, 2))
DTYPES = (
    *("<f8", ">f8", "<f4", "<f2", "<f16", "<i8", "<i1", "<u8", "<u4", "?", "<c16", "<U1", "<U9"),
    *("S4", "<M8[s]", "<m8[ns]", "V8", [("a", "<f8"), ("b", "<i4")], [("x", "<f8", (3,))]),
)
VALUES = (0, 1, -1, 2, 255, 2**31, -(2**31), 2**53 + 1, 1e300, -1e300, 5e-324, 1e39, 1e-39, 0.5)
VALUES += (float("nan"), float("inf"), float("-inf"))
CLAIMED = (
    *((2**62,), (2**31, 2**31), (10**9,), (1 << 36,), (24, 10**8), (-1,), (0, 2**60), (1.5, 2)),
    *((True,), ("a",), (2**64,), (10**12, 0), (1,) * 70),
)
DESCRS = ("'<f8'", "'|O'", "'<U1000000000'", "'V2147483647'", "[('a','<f8')]*9", "'<f8')", "None")
FIELDS = (
    "answer",
    "format",
    "material",
    "material.index",
    "positions",
    "sigma",
    "unit",
    "outliers",
)


def npy(value: np.ndarray) -> bytes:
    """An array as a member of an archive."""
    stream = io.BytesIO()
    np.lib.format.write_array(stream, value, allow_pickle=True)
    return stream.getvalue()


def claimed(descr: str, shape: object, order: bool = False, version: int = 1) -> bytes:
    """A member whose header claims what its 64 bytes of values do not hold."""
    head = f"{{'descr': {descr}, 'fortran_order': {order}, 'shape': {shape!r}, }}\n".encode()
    size = len(head).to_bytes(2 if version == 1 else 4, "little")
    return b"\x93NUMPY" + bytes([version, 0]) + size + head + bytes(64)


def members(content: bytes) -> dict[str, bytes]:
    """Those of an archive, by name."""
    with zipfile.ZipFile(io.BytesIO(content)) as file:
        return {name: file.read(name) for name in file.namelist()}


def packed(rows: list[tuple[str, bytes]]) -> bytes:
    """An archive of members, which may bear the same name."""
    stream = io.BytesIO()
    with warnings.catch_warnings(), zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as file:
        warnings.simplefilter("ignore")
        for name, content in rows:
            file.writestr(name, content)
    return stream.getvalue()


@st.composite
def arrays(draw: st.DrawFn) -> bytes:
    """Any small array of any type, or what only looks like one."""
    how = draw(st.integers(0, 9))
    if how == 0:
        shape, descr = draw(st.sampled_from(CLAIMED)), draw(st.sampled_from(DESCRS))
        return claimed(descr, shape, draw(st.booleans()), draw(st.sampled_from((1, 2, 3, 9))))
    if how == 1:
        return draw(st.binary(max_size=40))
    if how == 2:
        return npy(np.array([draw(st.sampled_from(({}, None, [1], "a")))], object))
    shape = draw(st.sampled_from(SHAPES))
    if how < 6:
        value = np.full(shape, draw(st.sampled_from(VALUES)))
        return npy(value)
    if how == 6:
        return npy(np.full(shape, draw(odd.words)))
    dtype = draw(st.sampled_from(DTYPES))
    return npy(np.zeros(shape, dtype, order=draw(st.sampled_from("CF"))))


@st.composite
def replaced(draw: st.DrawFn, kind: str, names: tuple[str, ...]) -> Input:
    """An archive with one to three of its members changed."""
    good = corpus.written()[draw(st.sampled_from(names))]
    own = members(good)
    rows = list(own.items())
    rng = random.Random(draw(st.integers(0, 2**32)))
    for _ in range(draw(st.sampled_from((1, 1, 2, 3)))):
        i = rng.randrange(len(rows))
        name, content = rows[i]
        how = draw(st.sampled_from(("array", "array", "values", "flip", "out", "twice", "name")))
        if how == "array":
            rows[i] = name, draw(arrays())
        elif how == "values":
            rows[i] = name, _revalued(content, rng)
        elif how == "flip":
            rows[i] = name, odd.flipped(content, rng)
        elif how == "out" and len(rows) > 1:
            del rows[i]
        elif how == "twice":
            rows.append((name, draw(arrays())))
        elif how == "name":
            rows[i] = (
                rng.choice((*FIELDS, "../x", "a" * 300)) + rng.choice((".npy", "")),
                content,
            )
    return Input(kind, {"a.npz": packed(rows)})


def _revalued(content: bytes, rng: random.Random) -> bytes:
    """The same array with one of its values another, or one of its texts garbled."""
    try:
        value = np.load(io.BytesIO(content))
    except Exception:  # it was changed before
        return content
    if value.dtype.kind == "U" and value.ndim == 0:
        return npy(np.array(odd.garbled(str(value).encode(), rng).decode(errors="replace")))
    if value.dtype.kind in "fiu" and value.size:
        value = value.astype(float)
        value.flat[rng.randrange(value.size)] = rng.choice(VALUES)
    return npy(value)


def bomb() -> bytes:
    """An array of zeros that packs to a thousandth."""
    return npy(np.zeros(1 << 23))


def nested(depth: int) -> bytes:
    """Observations whose material is mixed of mixed ones."""
    rows = dict(members(corpus.written()["seen.npz"]))
    rows = {name: content for name, content in rows.items() if not name.startswith("material")}
    index = npy(np.zeros(24, int))
    prefix = "material"
    for _ in range(depth):
        rows |= {f"{prefix}.npy": npy(np.array("Mixed")), f"{prefix}.index.npy": index}
        prefix += ".0"
    rows |= {f"{prefix}.npy": npy(np.array("Lambert")), f"{prefix}.albedo.npy": npy(np.array(0.5))}
    return packed(list(rows.items()))


@st.composite
def indexed(draw: st.DrawFn) -> Input:
    """A mixed material whose index is another."""
    rows = members(corpus.written()["seen.npz"])
    values = draw(st.sampled_from((0, 1, 7, 10**6, 10**9, 2**40, -1, 2**62)))
    kind = draw(st.sampled_from((np.int64, np.uint64, np.int32, float, bool)))
    shape = draw(st.sampled_from(((24,), (0,), (), (24, 1))))
    with np.errstate(all="ignore"):
        rows["material.index.npy"] = npy(np.full(shape, np.array(values).astype(kind)))
    return Input("observations", {"a.npz": packed(list(rows.items()))})


@functools.cache
def single() -> list[dict[str, bytes]]:
    """Archives that no change of a good one leads to."""
    good = corpus.written()["seen.npz"]
    rows = list(members(good).items())
    return [
        {"a.npz": b""},
        {"a.npz": npy(np.zeros(3))},
        {"a.npz": packed([])},
        {"a.npz": packed([("positions.npy", bomb()), *rows[1:]])},
        {"a.npz": packed([*rows, ("more.npy", bomb())])},
        {"a.npz": packed([(f"a{i}.npy", npy(np.zeros(1))) for i in range(1000)])},
        {"a.npz": packed([*rows, *rows])},
        *({"a.npz": nested(depth)} for depth in (1, 8, 100, 2000)),
        {"a.npz": None},
    ]


def inputs(kind: str, *names: str) -> st.SearchStrategy[Input]:
    """Archives that are read as that kind."""
    good = st.sampled_from(names).map(lambda name: corpus.written()[name])
    flips = good.flatmap(odd.changed).map(lambda content: Input(kind, {"a.npz": content}))
    rare = st.deferred(lambda: st.sampled_from(single())).map(lambda files: Input(kind, files))
    return st.one_of(replaced(kind, names), replaced(kind, names), flips, rare)
