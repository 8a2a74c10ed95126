"""Lights and results in JSON, suites in TOML."""

from __future__ import annotations

from hypothesis import strategies as st

from fuzz import corpus, odd
from fuzz.inputs import Input

LEAVES = (
    st.none()
    | st.booleans()
    | st.integers(-(2**70), 2**70)
    | st.floats()
    | st.sampled_from((10**400, "x", "", "\ud800", "NaN", [1, 2, 3], [[0, 0, 1]], {}))
    | st.text(max_size=5)
)
VALUES = st.recursive(LEAVES, lambda inner: st.lists(inner, max_size=4), max_leaves=8)
ROWS = st.fixed_dictionaries({"position": VALUES, "intensity": VALUES}) | VALUES
LIGHTS = st.fixed_dictionaries(
    {"lights": st.lists(ROWS, max_size=3) | VALUES}, optional={"format": VALUES}
)
DEEP = 100_000


def _json(value: object) -> bytes:
    import json

    return json.dumps(value).encode()


JSON = (
    *(
        b"",
        b"\0",
        b"[]",
        b"{}",
        b"null",
        b"NaN",
        b'"x"',
        b"\xff\xfe",
        b"\xef\xbb\xbf{}",
        b"1" * 10**5,
    ),
    *(b"[" * DEEP, b'{"lights":' * DEEP, b'{"lights":' + b"[" * DEEP + b"]" * DEEP + b"}"),
    b'{"lights": [{"position": [0,0,1' + b"0" * 5000 + b'], "intensity": [1]}]}',
    b'{"lights": [{"position": [0,0,1e999], "intensity": [1]}]}',
    b'{"lights": [{"position": [0,0,1], "intensity": [' + b"1," * 10**5 + b"1]}]}",
    b'{"lights": ' + b'[{"position": [0,0,1], "intensity": [1]}]' + b', "lights": 3}',
)
TABLES = (
    b"x,y,z,nx,ny,nz,lux,error\n0,0,0,0,0,1,120,2\n1,0,0,0,0,1,80,2\n0,1,0,0,0,1,60,1\n",
    b"\xef\xbb\xbf# desk\nx [mm];y [mm];z [mm];nx;ny;nz;radiance\n0,5;0;0;0;0;1;1,2\n1;2;0;0;0;1;2",
    b"X (cm)\tY (cm)\tZ (cm)\tNX\tNY\tNZ\tdx\tdy\tdz\tR\tG\tB\talbedo\n"
    b"0\t0\t0\t0\t0\t1\t0\t1\t1\t1\t2\t3\t0.5\n",
)
CSV = (
    *(b"", b"\0", b"\n", b"x", b"x,y,z", b",,,,,,", b'"', b'"' * 10**5, b"x,x,x,x,x,x,x\n"),
    *(b"," * 10**6, b"\xff\xfe", TABLES[0].replace(b"\n", b"\r"), TABLES[0] * 2000),
    TABLES[0].partition(b"\n")[0],
    TABLES[0].replace(b"lux", b"lux" + b"x" * 10**5),
    TABLES[0].replace(b"120", b"1" * 5000),
)
TOML = (
    *(b"", b"\0", b"case = 3", b"[[case]]", b"[case]", b"case = []", b"case = [[]]", b"\xff"),
    *(
        b"a = " + b"[" * DEEP,
        b"a = " + b"{a=" * DEEP,
        b"a = " + b"9" * 10**5,
        b"a." * DEEP + b"a = 1",
    ),
    *(b"[" + b"a." * 5000 + b"a]", b'a = """', b"a = 1e999999", b"a = 0x" + b"f" * 10**5),
    *(b"# " + b"x" * 10**6, b"a = 2000-99-99", b"defaults = 3\n[[case]]\nname = 'a'"),
    b'name = ["a"]\n' + corpus.SUITE.partition(b"\n")[2],
    b"name = 1979-05-27\n" + corpus.SUITE.partition(b"\n")[2],
    corpus.SUITE + corpus.SUITE.partition(b"\n")[2].partition(b"spp = 4\n")[2],
    *(
        corpus.SUITE.replace(b"seed = 7", b"seed = " + value)
        for value in (
            b"-1",
            b"1e3",
            b"nan",
            b"99999999999999999999",
            b"true",
            b"2000-01-01",
            b"'7'",
        )
    ),
    *(
        corpus.SUITE.replace(b"[[1, 1, 1, 5.0]]", b"[[1, 1, 1, " + value + b"]]")
        for value in (b"nan", b"inf", b"-1", b"1e308", b"[]", b"9" * 500)
    ),
    *(
        corpus.SUITE.replace(b"[[0, 0, 0], [4, 3, 2.5]]", value)
        for value in (
            b"[[nan, 0, 0], [1, 1, 1]]",
            b"[[1, 1, 1], [0, 0, 0]]",
            b"[]",
            b"[[0,0,inf],[1,1,1]]",
        )
    ),
    *(
        corpus.SUITE.replace(b"alpha = 0.2", value)
        for value in (
            b"alpha = nan",
            b"alpha = inf",
            b"'a b' = 1",
            b"'' = 1",
            b"self = 1",
            b"path = 1",
        )
    ),
    *(
        corpus.SUITE.replace(b"box_one", value)
        for value in (b"", b"/dev/zero", b"..", b"a\\u0000b", b"\\u202e", b"/", b"gone.xml")
    ),
)


def lights(kind: str) -> st.SearchStrategy[Input]:
    """JSON, read as that kind."""
    texts = st.one_of(
        st.sampled_from(JSON),
        LIGHTS.map(_json),
        *2 * [st.deferred(lambda: odd.changed(*_good(), text=True))],
    )
    return texts.map(lambda text: Input(kind, {"lights.json": text}))


def _good() -> list[bytes]:
    return [corpus.written()[name] for name in ("lights.json", "answer.json")]


def readings() -> st.SearchStrategy[Input]:
    """Tables of readings, in the ways that programs write them."""
    texts = st.sampled_from(CSV) | odd.changed(*TABLES, text=True)
    return texts.map(lambda text: Input("readings", {"readings.csv": text}))


def suites() -> st.SearchStrategy[Input]:
    """Suites."""
    texts = st.sampled_from(TOML) | odd.changed(corpus.SUITE, text=True)
    return texts.map(lambda text: Input("suite", {"suite.toml": text}))
