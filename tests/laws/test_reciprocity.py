"""Helmholtz reciprocity: f(l, w) = f(w, l)."""

import numpy as np
import pytest

from lightloc.brdf.protocol import evaluate

N = 4096
LEAST_COSINE = 0.01  # dividing by n.l costs eps / (n.l)


@pytest.fixture
def directions(rng, above):
    """Normals, and two directions above each, as float32 (what the kernel sees)."""
    n = rng.normal(size=(N, 3))
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    pair = above(n, LEAST_COSINE), above(n, LEAST_COSINE)
    return [v.astype(np.float32).astype(float) for v in (n, *pair)]


def both_ways(brdf, normals, l, w):
    """f(l, w) and f(w, l), the cosine divided out."""
    cos_l, cos_w = ((normals * v).sum(axis=1, keepdims=True) for v in (l, w))
    return evaluate(brdf, normals, l, w) / cos_l, evaluate(brdf, normals, w, l) / cos_w


def test_reciprocity(part, directions, eps):
    """Swapping light and viewer changes f by no more than rounding.

    Tolerance: cosines are off by eps and stand in the denominator; l + w is the same either way,
    but Fresnel's cosine is taken with w (off by eps over l.h).
    """
    n, l, w = directions
    one, other = both_ways(part.brdf, n, l, w)
    assert one.min() > 0
    cosines = [np.abs((n * v).sum(axis=1, keepdims=True)) for v in (l, w)]
    h = l + w
    cosines.append((l * h).sum(axis=1, keepdims=True) / np.linalg.norm(h, axis=1, keepdims=True))
    allowed = 2 * eps * (4 + sum(1 / c for c in cosines))
    assert (np.abs(one / other - 1) <= allowed).all()


def test_a_cosine_left_in_would_be_seen(part, directions):
    """Negative control: f (n.l)_+ itself is far from symmetric."""
    n, l, w = directions
    one, other = evaluate(part.brdf, n, l, w), evaluate(part.brdf, n, w, l)
    assert np.median(np.abs(one / other - 1)) > 0.1
