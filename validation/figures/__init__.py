"""The paper's Figures 1 to 6, drawn from our own scenes and fields.

One module per figure: what it shows is computed by one function, as a value that a test can judge,
and drawn by another, from the pieces of `validation.draw`. `page` sets them beside the paper's
captions.
"""
