"""The words of a scene file: elements, and the few things that most scenes are made of."""

from __future__ import annotations

from functools import partial

from strangers.world import World, text


def node(tag: str, plugin: str, *inside: str, **attributes: str) -> str:
    own = "".join(f' {name}="{value}"' for name, value in attributes.items())
    return f'<{tag} type="{plugin}"{own}>{"".join(inside)}</{tag}>'


def value(tag: str, name: str, what: object) -> str:
    return f'<{tag} name="{name}" value="{what}"/>'


shape, bsdf, emitter = (partial(node, tag) for tag in ("shape", "bsdf", "emitter"))
sensor, film, texture = (partial(node, tag) for tag in ("sensor", "film", "texture"))
number, string, rgb = (partial(value, tag) for tag in ("float", "string", "rgb"))
whole, yes = partial(value, "integer"), partial(value, "boolean", what="true")


def ref(name: str) -> str:
    return f'<ref id="{name}"/>'


def diffuse(*albedo: float) -> str:
    return bsdf("diffuse", rgb("reflectance", text(albedo or (0.5,))))


def both(one: str = "", other: str = "") -> str:
    """A surface that reflects on both sides."""
    return bsdf("twosided", one or diffuse(), other)


def box(w: World, low: tuple, high: tuple, *inside: str, **attributes: str) -> str:
    """A cube from corner to corner, its normals outward."""
    half = [(b - a) / 2 for a, b in zip(low, high, strict=True)]
    middle = [(b + a) / 2 for a, b in zip(low, high, strict=True)]
    put = scaled(*half) + moved(*middle)
    return shape("cube", w.place(put), *inside, **attributes)


def room(w: World, *inside: str) -> str:
    """Four metres by three by two and a half."""
    return box(w, (0, 0, 0), (4, 3, 2.5), *(inside or [both()]), id="room")


def block(w: World, *inside: str, **attributes: str) -> str:
    """Something to cast a shadow, on the floor of the room."""
    return box(w, (1.8, 1.2, 0), (2.3, 1.8, 0.9), *(inside or [diffuse(0.3)]), **attributes)


def square(w: World, put: str, *inside: str, **attributes: str) -> str:
    """Two metres by two around the origin, facing up, then put in its place."""
    return shape("rectangle", w.place(put), *inside, **attributes)


def ball(w: World, centre: tuple, radius: float, *inside: str, **attributes: str) -> str:
    put = [f'<point name="center" value="{w.point(*centre)}"/>', number("radius", w.length(radius))]
    return shape("sphere", *put, *inside, **attributes)


def scaled(x: float, y: float, z: float) -> str:
    return f'<scale x="{x!r}" y="{y!r}" z="{z!r}"/>'


def moved(x: float, y: float, z: float) -> str:
    return f'<translate x="{x!r}" y="{y!r}" z="{z!r}"/>'


def turned(axis: str, degrees: float) -> str:
    return f'<rotate {axis}="1" angle="{degrees!r}"/>'
