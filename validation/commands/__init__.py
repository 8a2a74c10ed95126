"""The commands of `lightloc`, a file each, and what they share."""
