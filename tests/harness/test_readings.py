"""Tables of readings: what was written is read, however it is spelled, or refused by its line."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from lightloc import Conductor, Irradiance, Lambert, read_readings
from lightloc.given.table import BLOCK

HEADER = "x,y,z,nx,ny,nz,lux"
ROW = "0,1,2,0,0,1,250"
POINT = "px [m],y [m],Z [m]"


@pytest.fixture
def read(tmp_path):
    """Read a text, or bytes, as a file."""

    def of(text: str | bytes, **options):
        path = tmp_path / "r.csv"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return read_readings(path, **options)

    return of


@pytest.mark.parametrize("seed", range(30))
def test_what_is_written_is_read(seed, read):
    """Any separator, order, case, unit, decimal mark and line end; comments and blank lines."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 40)) if seed else BLOCK + 1
    unit, metres = [("m", 1.0), ("mm", 1e-3), ("CM", 1e-2), ("Inch", 0.0254)][rng.integers(4)]
    colours = ["", " R", ".G", "_b"][1:] if rng.random() < 0.5 else [""]
    kind, form = [("Irradiance", "W/sr"), ("LUX", "cd")][rng.integers(2)]
    x, normal = rng.normal(size=(n, 3)) * 10.0 ** rng.integers(-3, 4), rng.normal(size=(n, 3))
    B, error = rng.random((n, len(colours))), rng.random(n)
    columns = {f"{a} [{unit}]": x[:, k] for k, a in enumerate("XYZ")}
    columns |= {f" N{a}": normal[:, k] for k, a in enumerate("xyz")}
    columns |= {f"{kind}{c}": B[:, k] for k, c in enumerate(colours)} | {"Error": error}
    columns["remark"] = ['"in, the; corner"'] * n
    separator = [",", ";", "\t"][rng.integers(3)]
    comma = separator != "," and rng.random() < 0.5
    order = rng.permutation(list(columns))

    def cell(value) -> str:
        text = value if isinstance(value, str) else repr(float(value))
        return text.replace(".", ",") if comma and value is not text else text

    lines = [separator.join(order)]
    for i in range(n):
        if rng.random() < 0.2:
            lines.append(["", "# a, remark; 3", separator * 3][rng.integers(3)])
        lines.append(separator.join(cell(columns[name][i]) for name in order))
    text = ["\n", "\r\n"][rng.integers(2)].join(lines)
    encoding = ["utf-8", "utf-8-sig", "utf-16"][rng.integers(3)]
    q = read(text.encode(encoding))
    scale = metres**2
    np.testing.assert_array_equal(q.positions, x)
    cosine = (q.normals * normal).sum(axis=1) / np.linalg.norm(normal, axis=1)
    np.testing.assert_allclose(cosine, 1, rtol=1e-14)
    np.testing.assert_array_equal(q.radiance, B * scale)
    np.testing.assert_array_equal(q.sigma, np.broadcast_to(error[:, None], B.shape) * scale)
    assert isinstance(q.material, Irradiance) and not q.interreflected
    assert (q.intensity_unit, q.intensity_unit) == (form, form)
    assert q.unit == {"Inch": "in"}.get(unit, unit.lower())


def test_units_that_nobody_says(read):
    """The unit of length is never assumed; it may be given."""
    q = read(f"{HEADER}\n{ROW}")
    assert (q.unit, q.intensity_unit, q.radiance.item(), q.sigma) == (
        "unit",
        "lx unit^2",
        250,
        None,
    )
    q = read(f"{HEADER}\n{ROW}", unit="cm")
    assert (q.unit, q.intensity_unit) == ("cm", "cd") and q.radiance.item() == pytest.approx(0.025)


@pytest.mark.parametrize(
    ("header", "row", "quantity", "power"),
    [
        ("x [m],y (m),z [m],nx,ny,nz,illuminance (lx)", ROW, "irradiance", "cd"),
        ("x [m],y [m],z [m],nx,ny,nz,irradiance [lux]", ROW, "irradiance", "cd"),
        (
            f"{POINT},normal.x,normal.y,normal.z,Irradiance [W/m²]",
            ROW,
            "irradiance",
            "W/sr",
        ),
        (
            "px [m],py [m],pz [m],nx,ny,nz,radiance [W m^-2 sr^-1],albedo",
            f"{ROW},0.5",
            "radiance",
            "W/sr",
        ),
        ("x [m],y [m],z [m],nx,ny,nz,cd/m2,albedo [%]", f"{ROW},50", "radiance", "cd"),
        ("x [m],y [m],z [m],nx,ny,nz,luminance [nits],reflectance", f"{ROW},0.5", "radiance", "cd"),
    ],
)
def test_quantities(header, row, quantity, power, read):
    """Names and units decide what was measured."""
    q = read(f"{header}\n{row}")
    assert (q.quantity, q.intensity_unit, q.radiance.item()) == (quantity, power, 250)
    if quantity == "radiance":
        assert q.material == Lambert(albedo=[[0.5]]) or q.material.albedo.tolist() == [[0.5]]


def test_errors_in_percent(read):
    q = read(f"{HEADER},error [%]\n{ROW},2\n{ROW},4")
    assert q.sigma.ravel().tolist() == [5, 10]


def test_colours_and_surfaces(read):
    """R, G and B are radiance; an albedo or a material is the surface's, with the way to look."""
    header, row = "x,y,z,nx,ny,nz,R,G,B", "0,1,2,0,0,1,3,4,5"
    q = read(f"{header}\n{row}", albedo=[0.2, 0.3, 0.4], interreflected=True)
    assert q.radiance.tolist() == [[3, 4, 5]] and q.interreflected
    metal = Conductor(alpha=0.2, eta=1.5, k=3.0)
    q = read(f"{header},dx,dy,dz\n{row},0,0.6,0.8", material=metal)
    assert q.material is metal and q.directions.tolist() == [[0, 0.6, 0.8]]


def table(*rows: str, header: str = HEADER) -> str:
    return "\n".join([header, *rows])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "is empty; expected a header and rows"),
        ("\n# only\n\n", "is empty; expected a header and rows"),
        (HEADER, "has no rows below its header in line 1"),
        (b"x,y\xff", "is no text in UTF-8"),
        (b"x,y\0,z", "is no text file"),
        (
            b"x,y\x01,nx,ny,nz,lux\n0,0,0,0,1,9",
            "has no column y (its header has x, y\\x01, nx, ny, n",
        ),
        (table("0,1,2,0,0,1,abc"), "line 2, column lux: 'abc' is not a number"),
        (table(ROW, "", "#", "0,1,2,0,0,1,"), "line 5, column lux: an empty cell is not a numb"),
        (table(ROW, "0,nan,2,0,0,1,3"), "line 3, column y: 'nan' is not a finite number"),
        (table(ROW, "0,1,2,0,0,1,1e999"), "line 3, column lux: '1e999' is not a finite number"),
        (table(ROW, "0,1,2,0,0,0,3"), "line 3, columns nx, ny, nz: the normal has length zero"),
        (table(ROW, "0,1,2,0,0,1"), "line 3 has 6 cells; its header has 7"),
        (table('0,1,2,0,0,"1,250'), "line 2: unexpected end of data"),
        (table(ROW, header="x,y,z,nx,ny,ux,lux"), "has no column nz (its header has x, y, z"),
        (table(ROW, header="x,y,z,nx,ny,nz,l"), "has no column of readings; expected one of lux"),
        (table(f"{ROW},3", header=f"{HEADER},radiance"), "columns lux and radiance are both"),
        (table(f"{ROW},3", header=f"{HEADER},LX"), "columns lux and LX say the same; expected"),
        (table(f"{ROW},3", header=f"{HEADER},X"), "column X stands twice"),
        (table(f"{ROW},3", header=f"{HEADER} R,lux G"), "has columns lux R, lux G; expected R, G"),
        (table(ROW, header="x [mm],y,z,nx,ny,nz,lux"), "columns x [mm], y, z have different unit"),
        (table(ROW, header="x [li],y [li],z [li],nx,ny,nz,lux"), "the unit of length is 'li'"),
        (table(ROW, header=HEADER + " [W]"), "column lux [W] has the unit 'W'; expected lx"),
        (table(ROW, header="x,y,z,nx,ny,nz,radiance"), "column radiance needs an albedo; expecte"),
        (table(f"{ROW},2", header="x,y,z,nx,ny,nz,radiance,albedo"), "line 2, column albedo: '2'"),
        (table(f"{ROW},-2", header=f"{HEADER},error"), "line 2, column error: '-2' is no standard"),
        (
            table("0,1,2,0,0,1,-5,0", header=f"{HEADER},sigma"),
            "line 2, column lux: '-5' is below",
        ),
        (table(f"{ROW},1", header=f"{HEADER},error [m]"), "column error [m] has the unit 'm'; ex"),
        (
            "x;y;z;nx;ny;nz;lux\n0;0;0;0;0;1;1,5\n0.5;0;0;0;0;1;2",
            "line 3, column x: '0.5' has a ",
        ),
        (
            "x;y;z;nx;ny;nz;lux\n0;0;0;0;0;1;1.250,5",
            "line 2, column lux: '1.250,5' is not",
        ),
    ],
)
def test_tables_that_are_refused(text, said, read, refuses, tmp_path):
    """One sentence with the file, and the line and the column where there are any."""
    with refuses(f"{tmp_path / 'r.csv'}: {said}"):
        read(text)


def test_arguments_that_are_refused(read, refuses, tmp_path):
    path = tmp_path / "r.csv"
    radiance = "x,y,z,nx,ny,nz,radiance\n" + ROW
    metal = Conductor(alpha=0.2, eta=1.5, k=3.0)
    for text, options, said in (
        (f"{HEADER}\n{ROW}", {"albedo": 0.5}, f"{path}: column lux is what arrives"),
        (f"{HEADER}\n{ROW}", {"unit": "yard"}, f"{path}: the unit of length is 'yard'"),
        (radiance, {"albedo": 0.5, "material": metal}, "read_readings takes an albedo or a mat"),
        (radiance, {"material": metal}, f"{path}: has no column dx"),
        (radiance, {"albedo": 1.5}, f"{path}: albedo is 1.5; expected at most 1"),
        (radiance, {"albedo": "dark"}, f"{path}: albedo is not an array of numbers"),
    ):
        with refuses(said):
            read(text, **options)
    with refuses(f"{path}: its unit of length is mm, not m"):
        read("x [mm],y [mm],z [mm],nx,ny,nz,lux\n" + ROW, unit="m")
    with refuses(f"{tmp_path}: can't be read"):
        read_readings(tmp_path)
    with refuses("gone.csv: no such file"):
        read_readings(Path("gone.csv"))


def test_a_pipe_is_no_table(tmp_path):
    """It might never end, or never begin."""
    os.mkfifo(tmp_path / "pipe.csv")
    with pytest.raises(ValueError, match="a device or a pipe"):
        read_readings(tmp_path / "pipe.csv")
