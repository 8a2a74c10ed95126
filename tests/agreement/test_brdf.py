"""Our BRDFs against Mitsuba's own, and against the textbook in NumPy.

Set-up: the same directions as float32, in the frame where the normal is z, so that neither side
loses digits to a rotation. Cosines run from 1e-3 (grazing) to 1, azimuths once around.
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from lightloc import BRDF, Conductor, Lambert, Plastic
from lightloc.brdf.protocol import evaluate
from render.variant import use_mitsuba

COSINES = np.geomspace(1e-3, 1, 13)
AZIMUTHS = 16
ALPHAS = [0.05, 0.1, 0.2, 0.4, 0.8]
EXACT_ENOUGH = 1e-4  # what the validation asks of Lambert and conductor
COAT = 128**2 * 6e-8  # Mitsuba sums its coat's table over 128^2 nodes, each half an eps off

ALUMINIUM = {"eta": 1.2, "k": 7.0}
GOLD = {"eta": [0.2, 0.9, 1.1], "k": [3.9, 2.4, 2.1]}


def directions(cosines=COSINES) -> tuple[np.ndarray, np.ndarray]:
    """Every pair of cosines at every azimuth between: l and w, each (m, 3), float32 values."""
    turn = (np.arange(AZIMUTHS) + 0.3) * 2 * np.pi / AZIMUTHS
    mu_l, mu_w, phi = (v.ravel() for v in np.meshgrid(cosines, cosines, turn, indexing="ij"))
    sin_l, sin_w = np.sqrt(1 - mu_l**2), np.sqrt(1 - mu_w**2)
    l = np.stack([sin_l * np.cos(phi), sin_l * np.sin(phi), mu_l], axis=1)
    w = np.stack([sin_w, 0 * phi, mu_w], axis=1)
    return l.astype(np.float32).astype(float), w.astype(np.float32).astype(float)


def up(n: int) -> np.ndarray:
    return np.broadcast_to([0.0, 0.0, 1.0], (n, 3))


def rgb(value) -> dict:
    """A colour as Mitsuba's dictionaries want it; a number is grey."""
    if np.ndim(value):
        return {"type": "rgb", "value": list(value)}
    return {"type": "spectrum", "value": float(value)}


def mitsuba(bsdf: dict, l: np.ndarray, w: np.ndarray) -> np.ndarray:
    """Mitsuba's f (n.l)_+ at local directions, (m, 3)."""
    use_mitsuba()
    si = dr.zeros(mi.SurfaceInteraction3f, len(l))
    si.sh_frame = mi.Frame3f(mi.Vector3f(0, 0, 1))
    si.wi = mi.Vector3f(w.T.astype(np.float32))
    value = mi.load_dict(bsdf).eval(mi.BSDFContext(), si, mi.Vector3f(l.T.astype(np.float32)))
    return np.array(value, float).T


def disagreement(brdf: BRDF, bsdf: dict) -> float:
    """The worst relative difference over all directions and channels."""
    l, w = directions()
    theirs, ours = mitsuba(bsdf, l, w), evaluate(brdf, up(len(l)), l, w)
    assert theirs.min() > 0
    return float(np.abs(ours / theirs - 1).max())


def lobe_rounding(alpha: float, eps: float) -> float:
    """Float32 error of a lobe evaluated in its own frame.

    About 16 operations in a row, half an eps each; and h is off by eps, which changes ln D by up
    to 2 / alpha of that.
    """
    return eps * (8 + 2 / alpha)


def conductor(alpha, eta=None, k=None, specular=1.0) -> dict:
    kind = {"material": "none"} if eta is None else {"eta": rgb(eta), "k": rgb(k)}
    return {
        "type": "roughconductor",
        "distribution": "ggx",
        "alpha": alpha,
        "specular_reflectance": rgb(specular),
        **kind,
    }


def plastic(alpha, diffuse, ior, specular=1.0, nonlinear=False) -> dict:
    return {
        "type": "roughplastic",
        "distribution": "ggx",
        "alpha": alpha,
        "int_ior": ior,
        "ext_ior": 1.0,
        "diffuse_reflectance": rgb(diffuse),
        "specular_reflectance": rgb(specular),
        "nonlinear": nonlinear,
    }


@pytest.mark.parametrize("albedo", [0.5, [0.8, 0.4, 0.1]])
def test_lambert(albedo, eps):
    """Diffuse reflection is two multiplications: at most four roundings apart."""
    bsdf = {"type": "diffuse", "reflectance": rgb(albedo)}
    assert disagreement(Lambert(albedo=albedo), bsdf) <= 4 * eps


@pytest.mark.parametrize("alpha", ALPHAS)
@pytest.mark.parametrize(
    "metal",
    [{}, ALUMINIUM, GOLD, {**GOLD, "specular": [0.9, 0.8, 0.5]}],
    ids=["none", "aluminium", "gold", "tinted"],
)
def test_conductor(alpha, metal, eps):
    """GGX with Fresnel's exact equations, grey and coloured, and with F = 1 ('none')."""
    limit = lobe_rounding(alpha, eps)
    assert limit < EXACT_ENOUGH
    assert disagreement(Conductor(alpha=alpha, **metal), conductor(alpha, **metal)) <= limit


@pytest.mark.parametrize("nonlinear", [False, True])
@pytest.mark.parametrize(
    ("alpha", "ior"), [(0.05, 1.3), (0.1, 1.49), (0.2, 1.9), (0.4, 1.49), (0.8, 1.1)]
)
def test_plastic(alpha, ior, nonlinear):
    """A coloured base under a coloured coat, with and without the shift of colour inside."""
    colours = {"diffuse": [0.8, 0.4, 0.1], "specular": [1.0, 0.7, 0.5]}
    values = {"alpha": alpha, "ior": ior, "nonlinear": nonlinear, **colours}
    assert disagreement(Plastic(**values), plastic(**values)) <= COAT


def test_wrong_parameters_are_seen(eps):
    """Negative control: 1 % off in any one parameter is beyond the tolerance."""
    base = {"alpha": 0.2, **ALUMINIUM, "specular": 0.9}
    for name, value in base.items():
        wrong = disagreement(Conductor(**{**base, name: 1.01 * value}), conductor(**base))
        assert wrong > 5 * lobe_rounding(0.2, eps), name
    coat = {"alpha": 0.2, "diffuse": 0.5, "ior": 1.9, "specular": 0.9, "nonlinear": True}
    for name, value in coat.items():
        changed = {"nonlinear": False}.get(name, 1.01 * value)
        assert disagreement(Plastic(**{**coat, name: changed}), plastic(**coat)) > 5 * COAT, name


def test_another_distribution_is_seen():
    """Negative control: Beckmann's lobe in place of GGX's differs by far more than 1 %."""
    beckmann = {**conductor(0.2), "distribution": "beckmann"}
    l, w = directions()
    ours, theirs = evaluate(Conductor(alpha=0.2), up(len(l)), l, w), mitsuba(beckmann, l, w)
    assert np.median(np.abs(ours - theirs) / ours) > 0.1


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return (a * b).sum(axis=1)


def textbook(alpha: float, index: complex, n, l, w) -> np.ndarray:
    """f (n.l)_+ in float64 from the formulas as printed, (m,).

    Walter et al. (2007): equation 20 with D of 33 and G1 of 34; Fresnel's amplitudes with the
    complex index of refraction.
    """
    h = (l + w) / np.linalg.norm(l + w, axis=1, keepdims=True)
    tan2_h, tan2_l, tan2_w = (1 / dot(n, v) ** 2 - 1 for v in (h, l, w))
    D = alpha**2 / (np.pi * dot(n, h) ** 4 * (alpha**2 + tan2_h) ** 2)
    G = 4 / np.prod([1 + np.sqrt(1 + alpha**2 * tan2) for tan2 in (tan2_l, tan2_w)], axis=0)
    cosine = dot(w, h)
    inside = np.sqrt(index**2 - (1 - cosine**2))
    r_s = (cosine - inside) / (cosine + inside)
    r_p = (index**2 * cosine - inside) / (index**2 * cosine + inside)
    F = (np.abs(r_s) ** 2 + np.abs(r_p) ** 2) / 2
    return F * D * G / (4 * dot(n, w))


@pytest.mark.parametrize("alpha", ALPHAS)
def test_conductor_is_the_textbooks(alpha, eps, rng):
    """Our kernel, in tilted frames, against the printed formulas in float64.

    Tolerance: as in the lobe's own frame, and each cosine with the normal is off by eps, hence
    by eps over itself; h stands off by eps / |l + w| where l and w nearly cancel.
    """
    l, w = directions(np.geomspace(1e-2, 1, 9))
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    n, l, w = (
        v.astype(np.float32).astype(float) for v in (up(len(l)) @ turn.T, l @ turn.T, w @ turn.T)
    )
    # Rounded vectors are unit only to eps; the printed formulas assume exactly unit ones.
    n, l, w = (v / np.linalg.norm(v, axis=1, keepdims=True) for v in (n, l, w))
    ours = evaluate(Conductor(alpha=alpha, eta=1.2, k=7.0), n, l, w)[:, 0]
    printed = textbook(alpha, 1.2 + 7j, n, l, w)
    cosines = 1 / np.abs(dot(n, l)) + 1 / np.abs(dot(n, w))
    shortest = np.linalg.norm(l + w, axis=1)
    allowed = lobe_rounding(alpha, eps) * (1 + 1 / shortest) + 2 * eps * cosines
    assert (np.abs(ours / printed - 1) <= allowed).all()
    assert np.median(allowed) < EXACT_ENOUGH
