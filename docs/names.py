"""Names in code type become links to the reference, in pages as in docstrings.

In a page a public name of lightloc may stand alone, and one of the other packages carries its
package: ``radiance``, ``render.observe``. In a docstring single backticks link, by Sphinx's own
rules, and what is in two is code. What is not in the reference stays code in both.
"""

from __future__ import annotations

import re
from enum import Enum
from typing import Any

from docutils import nodes
from sphinx import addnodes
from sphinx.application import Sphinx

import lightloc

QUALIFIED = re.compile(r"(lightloc|render|validation)(\.\w+)+")
LAMBDA = "<function <lambda>>"  # what Sphinx has of a default, and cannot read again
ALIAS = re.compile(r"TypeAliasForwardRef\('(\w+)'\)")  # Sphinx's word for one that may be None


def target_of(text: str) -> str | None:
    """The full name that code type in a text stands for; None where it is no public name.

    Examples
    --------
    >>> target_of("radiance"), target_of("render.observe"), target_of("k = 0.05")
    ('lightloc.radiance', 'render.observe', None)
    """
    if text in lightloc.__all__:
        return f"lightloc.{text}"
    return text if QUALIFIED.fullmatch(text) else None


def link(app: Sphinx, doctree: nodes.document) -> None:
    """Wrap code type that is a name in a reference that may come to nothing."""
    left = (addnodes.desc, addnodes.pending_xref, nodes.reference, nodes.title)
    as_it_is = {
        literal
        for node in doctree.findall()
        if isinstance(node, left)
        for literal in node.findall(nodes.literal)
    }
    for literal in list(doctree.findall(nodes.literal)):
        target = target_of(literal.astext())
        if target is None or literal in as_it_is:
            continue
        reference = addnodes.pending_xref(
            "", refdomain="py", reftype="obj", reftarget=target, refdoc=app.env.docname
        )
        literal.replace_self(reference)
        reference += literal


def signed(
    app: Sphinx, what: str, name: str, thing: Any, options: Any, arguments: str, returned: str
) -> tuple[str, str] | None:
    """Arguments with the aliases as they are written, and none where a class is never called.

    A default that is a function without a name becomes three dots.
    """
    if what == "class" and (getattr(thing, "_is_protocol", False) or is_enum(thing)):
        return "", ""
    if not arguments:
        return None
    arguments = arguments.replace(LAMBDA, "...")
    return ALIAS.sub(r"\1", arguments), ALIAS.sub(r"\1", returned or "")


def with_members(
    app: Sphinx, what: str, name: str, thing: Any, options: Any, lines: list[str]
) -> None:
    """Below an enumeration's docstring, its members and what they say."""
    if is_enum(thing):
        lines += [f"- ``{member.name}``: {member.value}" for member in thing]


def in_one_sentence(
    app: Sphinx, what: str, name: str, thing: Any, options: Any, lines: list[str]
) -> None:
    """What a property's docstring says before a colon is no type, as napoleon has it."""
    if what != "property":
        return
    begun = [line.removeprefix(":type: ") for line in lines if line.startswith(":type: ")]
    if begun:
        rest = [line for line in lines if not line.startswith(":type: ")]
        lines[:] = [f"{begun[0]}: {rest[0]}", *rest[1:]]


def is_enum(thing: Any) -> bool:
    return isinstance(thing, type) and issubclass(thing, Enum)


def setup(app: Sphinx) -> dict[str, bool]:
    app.connect("doctree-read", link)
    app.connect("autodoc-process-signature", signed)
    app.connect("autodoc-process-docstring", with_members)
    app.connect("autodoc-process-docstring", in_one_sentence, priority=900)  # after napoleon
    return {"parallel_read_safe": True, "parallel_write_safe": True}
