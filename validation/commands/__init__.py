"""The commands of `lightloc`, one file each, and what they share."""
