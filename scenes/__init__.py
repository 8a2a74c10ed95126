"""Rooms with hidden lights, as Mitsuba 3 scene files.

Each NAME.xml is a closed room in metres, lit by nothing but `point` emitters in W/sr with the ids
light_1, light_2, ...; these are the truth that a search is judged by. A comment at the head of
each file says what the room is for, `$spp`, `$max_depth` and a few more names are parameters with
defaults, and meshes/ holds the shapes that Mitsuba has no primitive for.
"""
