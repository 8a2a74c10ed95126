"""Oren and Nayar's BRDF, which `render` adds to Mitsuba: laws, and the formula written apart."""

from __future__ import annotations

import subprocess
import sys

import mitsuba as mi
import numpy as np
import pytest

import render
from render.variant import use_mitsuba

ALPHAS = (0.0, 0.2, 0.7, 1.5)
ALBEDO = (0.6, 0.3, 0.2)


@pytest.fixture(scope="module", autouse=True)
def variant() -> None:
    use_mitsuba()


def plaster(alpha: float, albedo: tuple[float, float, float] = ALBEDO):
    colour = {"type": "rgb", "value": list(albedo)}
    return mi.load_dict({"type": "roughdiffuse", "alpha": alpha, "reflectance": colour})


def directions(rng, n: int) -> np.ndarray:
    """(n, 3) above the surface."""
    v = rng.normal(size=(n, 3))
    v[:, 2] = np.abs(v[:, 2]) + 0.02
    return v / np.linalg.norm(v, axis=1, keepdims=True)


def f(bsdf, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """(n, 3) of the BRDF alone, without the cosine."""
    si = mi.SurfaceInteraction3f()
    si.wi = mi.Vector3f(wi.T)
    value = bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(wo.T))
    return np.broadcast_to(np.array(value).T, wo.shape) / wo[:, 2:]


def by_angles(wi: np.ndarray, wo: np.ndarray, sigma: float, albedo: np.ndarray) -> np.ndarray:
    """Equations 30 and 31 of the paper, with its angles."""
    ti, to = np.arccos(wi[:, 2]), np.arccos(wo[:, 2])
    turn = np.cos(np.arctan2(wi[:, 1], wi[:, 0]) - np.arctan2(wo[:, 1], wo[:, 0]))
    a, b, s = np.maximum(ti, to), np.minimum(ti, to), sigma**2
    c1 = 1 - 0.5 * s / (s + 0.33)
    c2 = 0.45 * s / (s + 0.09) * np.where(turn >= 0, np.sin(a), np.sin(a) - (2 * b / np.pi) ** 3)
    c3 = 0.125 * s / (s + 0.09) * (4 * a * b / np.pi**2) ** 2
    one = c1 + turn * c2 * np.tan(b) + (1 - np.abs(turn)) * c3 * np.tan((a + b) / 2)
    two = 0.17 * s / (s + 0.13) * (1 - turn * (2 * b / np.pi) ** 2)
    return (albedo * one[:, None] + albedo**2 * two[:, None]) / np.pi


@pytest.mark.parametrize("alpha", ALPHAS)
def test_is_the_paper_s_formula(alpha, rng):
    """With facets that deviate by alpha / sqrt(2)."""
    wi, wo = directions(rng, 500), directions(rng, 500)
    wanted = by_angles(wi, wo, alpha / np.sqrt(2), np.array(ALBEDO))
    assert np.allclose(f(plaster(alpha), wi, wo), wanted, rtol=1e-4, atol=1e-5)


def test_smooth_is_diffuse(rng):
    wi, wo = directions(rng, 200), directions(rng, 200)
    assert np.allclose(f(plaster(0.0), wi, wo), np.array(ALBEDO) / np.pi, rtol=1e-5)
    rough = f(plaster(0.7), wi, wo)
    assert not np.allclose(rough, np.array(ALBEDO) / np.pi, rtol=0.05)


@pytest.mark.parametrize("alpha", ALPHAS)
def test_reciprocity(alpha, rng):
    """Light takes the same way back."""
    wi, wo = directions(rng, 500), directions(rng, 500)
    bsdf = plaster(alpha)
    assert np.allclose(f(bsdf, wi, wo), f(bsdf, wo, wi), rtol=1e-4)


@pytest.mark.parametrize("alpha", ALPHAS)
def test_samples_agree_with_the_integral_and_reflect_no_more_than_comes(alpha, rng):
    """The mean of what `sample` returns is the albedo that `eval` integrates to: at most 1."""
    n = 20_000
    bsdf = plaster(alpha, (1.0, 0.5, 0.25))
    wo = directions(rng, 1)
    si = mi.SurfaceInteraction3f()
    si.wi = mi.Vector3f(np.repeat(wo, n, axis=0).T)
    _, weight = bsdf.sample(mi.BSDFContext(), si, 0.5, mi.Point2f(rng.uniform(size=(2, n))))
    sampled = np.array(weight).reshape(3, -1)
    u, phi = np.meshgrid((np.arange(200) + 0.5) / 200, 2 * np.pi * (np.arange(200) + 0.5) / 200)
    z = np.sqrt(u).ravel()  # even over the projected hemisphere
    rest = np.sqrt(1 - z**2)
    there = np.stack([rest * np.cos(phi.ravel()), rest * np.sin(phi.ravel()), z], axis=1)
    whole = np.pi * f(bsdf, np.repeat(wo, len(there), axis=0), there).mean(axis=0)
    error = sampled.std(axis=1) / np.sqrt(n)
    assert (np.abs(sampled.mean(axis=1) - whole) < 5 * error + 2e-3).all()
    assert (whole <= 1.02).all()  # the formula is a fit: 2 % over at worst


def test_a_roughness_that_is_none_is_refused_in_one_sentence(tmp_path, refuses):
    """Below 0, and a property that it does not have."""
    for inside, said in (
        ('<float name="alpha" value="-1"/>', "alpha is -1; expected a finite number, at least 0"),
        ('<texture name="alpha" type="checkerboard"/>', "the alpha of a roughdiffuse is no number"),
        ('<rgb name="reflectance" value="3"/>', "Invalid RGB reflectance"),
        ('<float name="sigma" value="1"/>', "the bsdf 'roughdiffuse' has no property 'sigma'"),
    ):
        file = tmp_path / "room.xml"
        file.write_text(
            '<scene version="3.0.0"><shape type="rectangle"><bsdf type="roughdiffuse">'
            f'{inside}</bsdf></shape><emitter type="point"/></scene>'
        )
        with refuses(str(file)) as refused:
            render.load(file)
        assert said in str(refused.value) and "Traceback" not in str(refused.value)


def test_is_known_whoever_set_mitsuba_s_variant():
    """Also where a user has, before `render` is imported."""
    code = (
        "import lightloc, mitsuba as mi; mi.set_variant('llvm_ad_rgb'); import render; "
        "print(render.load('box_kinds', material='rough_diffuse').name)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout.strip() == "box_kinds", done.stderr
