"""Rooms with known lights, in two and three dimensions, that studies and figures look at.

For other rooms, in pipeline order:

- `SQUARE`: the corners of the square room.
- `SAMPLES`: observations of a 2D room (section 4.1).
- `INTENSITIES`: the range of a light's intensity (section 6.1).
- `shot_noise`: the standard error of section 6.1's noise.
- `PlaneRoom`: a 2D room and the truth about its lights.
- `rooms`: square rooms, as in section 6.1.
- `rooms_with_discs`: the same with occluders.
- `ROOMS`: the kinds of rooms in three dimensions.
- `MOST`: the largest number of lights in one.
- `lit`: a standard scene with random lights of its own.
- `REGIONS`: the regions of a box with blocks in it.
- `BlockRoom`: such a room and the truth about its lights.
- `Blocks`: its geometry.
- `block_room`: one at random.
- `under`: observations with the B of lights.
"""

from validation.rooms.blocks import REGIONS, BlockRoom, Blocks, block_room, under
from validation.rooms.plane import (
    INTENSITIES,
    SAMPLES,
    SQUARE,
    PlaneRoom,
    rooms,
    rooms_with_discs,
    shot_noise,
)
from validation.rooms.relit import MOST, ROOMS, lit

__all__ = [
    "SQUARE",
    "SAMPLES",
    "INTENSITIES",
    "shot_noise",
    "PlaneRoom",
    "rooms",
    "rooms_with_discs",
    "ROOMS",
    "MOST",
    "lit",
    "REGIONS",
    "BlockRoom",
    "Blocks",
    "block_room",
    "under",
]
