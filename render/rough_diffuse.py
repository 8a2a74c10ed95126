"""Rough diffuse reflection, by Oren and Nayar, as the BSDF ``roughdiffuse``, which Mitsuba 3 lacks.

As in Mitsuba 0.6, ``reflectance`` is the facets' albedo, a colour or a texture, and ``alpha``, here
a number, the root mean square of their slopes: their orientations deviate by ``alpha / sqrt(2)``
radians about any one axis.
"""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi

NAME = "roughdiffuse"
REFLECTANCE, ALPHA = 0.5, 0.2  # where a scene says nothing


def register() -> None:
    """Let the variant that is set know the BSDF."""

    class RoughDiffuse(mi.BSDF):  # exists only once a variant is set
        def __init__(self, props: Any) -> None:
            mi.BSDF.__init__(self, props)
            self.reflectance = props.get_texture("reflectance", REFLECTANCE)
            self.alpha = float(props.get("alpha", ALPHA))
            self.m_components = [mi.BSDFFlags.DiffuseReflection | mi.BSDFFlags.FrontSide]
            self.m_flags = self.m_components[0]

        def traverse(self, callback: Any) -> None:
            callback.put("reflectance", self.reflectance, mi.ParamFlags.Differentiable)

        def eval(self, context: Any, si: Any, wo: Any, active: Any = True) -> Any:
            lit = active & (si.wi.z > 0) & (wo.z > 0)
            albedo = self.reflectance.eval(si, lit)
            value = reflected(albedo, self.alpha / 2**0.5, si.wi, wo) * wo.z
            return dr.select(lit, value, 0)

        def pdf(self, context: Any, si: Any, wo: Any, active: Any = True) -> Any:
            lit = active & (si.wi.z > 0) & (wo.z > 0)
            return dr.select(lit, mi.warp.square_to_cosine_hemisphere_pdf(wo), 0)

        def eval_pdf(self, context: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval(context, si, wo, active), self.pdf(context, si, wo, active)

        def sample(
            self, context: Any, si: Any, sample1: Any, sample2: Any, active: Any = True
        ) -> Any:
            bs = dr.zeros(mi.BSDFSample3f)
            bs.wo = mi.warp.square_to_cosine_hemisphere(sample2)
            bs.pdf = mi.warp.square_to_cosine_hemisphere_pdf(bs.wo)
            bs.eta, bs.sampled_component = 1.0, mi.UInt32(0)
            bs.sampled_type = mi.UInt32(+mi.BSDFFlags.DiffuseReflection)
            value = self.eval(context, si, bs.wo, active)
            return bs, dr.select(bs.pdf > 0, value / bs.pdf, 0)

        def to_string(self) -> str:
            return f"RoughDiffuse[reflectance = {self.reflectance}, alpha = {self.alpha:g}]"

        def class_name(self) -> str:
            return "RoughDiffuse"

    mi.register_bsdf(NAME, RoughDiffuse)


def fault(props: Any) -> str | None:
    """What is wrong with its properties in a scene; None where nothing is."""
    if "alpha" not in props:
        return None
    if props.type("alpha") not in (mi.Properties.Type.Float, mi.Properties.Type.Integer):
        return f"the alpha of a {NAME} is no number"
    alpha = props["alpha"]
    good = 0 <= alpha < float("inf")
    return None if good else f"alpha is {alpha:g}; expected a finite number, at least 0"


def reflected(albedo: Any, sigma: float, wi: Any, wo: Any) -> Any:
    """The BRDF of V-shaped grooves whose facets' slopes deviate by sigma radians.

    Equations 30 and 31 of Oren and Nayar, "Generalization of Lambert's Reflectance Model",
    SIGGRAPH 1994: light that one facet reflects, and light that two do. Directions are local, both
    above the surface; ``beta`` is the angle of the one that is nearer to the normal.
    """
    square = sigma * sigma
    high, low = dr.maximum(wi.z, wo.z), dr.clip(dr.minimum(wi.z, wo.z), 1e-4, 1)
    alpha, beta = dr.safe_acos(low), dr.safe_acos(high)
    sin_a, sin_b = dr.safe_sqrt(1 - low * low), dr.safe_sqrt(1 - high * high)
    across = wi.x * wo.x + wi.y * wo.y
    turn = dr.select(sin_a * sin_b > 0, dr.clip(across / (sin_a * sin_b), -1, 1), 0)
    share = 2 * beta * dr.inv_pi
    c1 = 1 - 0.5 * square / (square + 0.33)
    c2 = 0.45 * square / (square + 0.09) * (sin_a - dr.select(turn < 0, share * share * share, 0))
    both = 4 * alpha * beta * dr.inv_pi * dr.inv_pi
    c3 = 0.125 * square / (square + 0.09) * both * both
    half = (sin_a + sin_b) / (low + high)  # the tangent of (alpha + beta) / 2
    once = c1 + turn * c2 * sin_b / high + (1 - dr.abs(turn)) * c3 * half
    twice = 0.17 * square / (square + 0.13) * (1 - turn * share * share)
    return albedo * dr.inv_pi * (once + albedo * twice)
