"""Five rooms of our own triangles, as another renderer, Blender Cycles, sees them.

What `rooms.render_cycles` saw of each room lies beside this page; the triangles are made anew,
bit by bit the same, by `rooms.arches`, `rooms.stairs`, `rooms.plants`, `rooms.library` and
`rooms.clutter`, which need numpy and nothing else. `rooms.loader` brings both together.

Lights stand 0.3 m or more from every surface, light a fair part of what the camera sees, and were
moved, before any search was tried, to where the Cramér-Rao bound of every position is below
0.6 mm (all lights together, noise of 0.003 B + 0.001 mean B): what is wanted is a fair question.
"""

NAMES = ("arches", "stairs", "plants", "library", "clutter")
