"""Files and commands that nobody means, given to all that reads input.

`fuzz.kinds` makes them, by Hypothesis and by changing bytes of good files. `fuzz.judge` takes each
in, within a child that `fuzz.watch` holds to limits of time and memory; it is loaded, and then what
its type promises, or refused in one sentence that names the file. All else is a fault, and
``python tests/fuzz/run.py`` counts them.
"""
