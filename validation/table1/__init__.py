"""Table 1 of the paper (section 6.1): the rooms, the columns, and the run over all 800 scenes."""
