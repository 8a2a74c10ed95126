"""White furnace: no surface reflects more light than it receives."""

import functools

import numpy as np
import pytest
from scipy.integrate import quad

from lightloc import Conductor, Lambert, Plastic
from lightloc.brdf.protocol import evaluate

NODES = 512  # an axis: 3 mrad apart, for lobes of 50 mrad and more
COSINES = [0.05, 0.3, 0.7, 1.0]
QUADRATURE = 2e-4  # measured against the closed form below, which is met to 1e-4


@functools.cache
def hemisphere() -> tuple[np.ndarray, np.ndarray]:
    """Directions (m, 3) and the solid angle of each.

    Gauss-Legendre in the angle to the normal, midpoints around it (one half: the BRDFs are
    isotropic).
    """
    x, weight = np.polynomial.legendre.leggauss(NODES)
    angle, weight = np.pi / 4 * (x + 1), np.pi / 4 * weight
    turn = (np.arange(NODES) + 0.5) * np.pi / NODES
    theta, phi = (v.ravel() for v in np.meshgrid(angle, turn, indexing="ij"))
    l = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=1)
    return l, np.repeat(weight * np.sin(angle), NODES) * 2 * np.pi / NODES


def directional_albedo(brdf, mu: float) -> np.ndarray:
    """The part of a beam at cosine mu that is reflected: integral of f (n.l)_+ over all l, (c,)."""
    l, area = hemisphere()
    up = np.broadcast_to([0.0, 0.0, 1.0], l.shape)
    w = np.broadcast_to([np.sqrt(1 - mu * mu), 0.0, mu], l.shape)
    return area @ evaluate(brdf, up, l, w)


@pytest.mark.parametrize("mu", COSINES)
def test_lambert_reflects_its_albedo(mu):
    """A Lambertian surface reflects exactly its albedo, from wherever the light comes."""
    albedo = [0.9, 0.5, 0.1]
    np.testing.assert_allclose(directional_albedo(Lambert(albedo=albedo), mu), albedo, rtol=1e-6)


@pytest.mark.parametrize("alpha", [0.05, 0.1, 0.2, 0.4, 0.8])
def test_conductor_at_normal_incidence(alpha):
    """With F = 1 the loss at normal incidence is Smith's masking alone.

    In u = 1 - 1 / (1 + tan^2(theta_h) / alpha^2) the distribution is uniform, and the albedo is
    the mean of G1(2 theta_h) over the h whose l is above the horizon.
    """

    def masking(u: float) -> float:
        theta = np.arctan(alpha * np.sqrt(u / (1 - u)))
        if theta >= np.pi / 4:
            return 0.0
        return 2 / (1 + np.sqrt(1 + (alpha * np.tan(2 * theta)) ** 2))

    horizon = 1 / (1 + alpha**2)  # theta_h = 45 degrees
    expected, _ = quad(masking, 0, horizon, epsabs=1e-8)
    albedo = directional_albedo(Conductor(alpha=alpha), 1.0)
    assert albedo[0] == pytest.approx(expected, abs=QUADRATURE / 2)


@pytest.mark.parametrize("mu", COSINES)
@pytest.mark.parametrize("alpha", [0.05, 0.2, 0.8])
def test_conductor_never_gains(alpha, mu):
    """With F = 1 a conductor reflects no more than arrives."""
    assert directional_albedo(Conductor(alpha=alpha), mu)[0] <= 1 + QUADRATURE


@pytest.mark.parametrize("mu", [mu for mu in COSINES if mu >= 0.3])
def test_a_smooth_conductor_loses_little(mu, alpha=0.05):
    """With F = 1 a conductor loses only what is masked: a share of O(alpha^2 tan^2)."""
    assert directional_albedo(Conductor(alpha=alpha), mu)[0] >= 1 - 4 * alpha**2 / mu**2


@pytest.mark.parametrize("mu", COSINES)
@pytest.mark.parametrize("nonlinear", [False, True])
def test_white_plastic_never_gains(mu, nonlinear):
    """Coat and white base together reflect no more than arrives.

    They reflect less: the model has no light that bounces between facets, which is up to a third.
    """
    brdf = Plastic(alpha=0.3, diffuse=1.0, ior=1.5, nonlinear=nonlinear)
    assert 0.6 < directional_albedo(brdf, mu)[0] <= 1 + QUADRATURE


def test_metal_reflects_less_than_a_mirror():
    """Fresnel's term only takes away: eta and k give less than F = 1, in each channel."""
    mirror = directional_albedo(Conductor(alpha=0.2), 0.7)
    gold = directional_albedo(Conductor(alpha=0.2, eta=[0.2, 0.9, 1.1], k=[3.9, 2.4, 2.1]), 0.7)
    assert (gold < mirror).all()
    assert gold[0] > gold[1] > gold[2] > 0.3


def test_a_gain_of_one_percent_would_be_seen():
    """Negative control: a smooth conductor with 1 % too much reflectance breaks the law."""
    assert directional_albedo(Conductor(alpha=0.05, specular=1.01), 1.0)[0] > 1 + QUADRATURE
