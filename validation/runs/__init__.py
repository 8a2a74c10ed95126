"""Named scenes in, records out: run on all cores or a cluster, kept as they end, and resumed."""
