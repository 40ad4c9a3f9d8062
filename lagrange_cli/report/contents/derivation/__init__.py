"""A document of a derivation as sections of words and formulas, the same for every format.

Equations and the names of the parts that are wanted go in; headings, sentences, tables and labelled
display trees come out, in one order. LaTeX, Typst, Markdown and HTML print them, in one of several
languages, and decide nothing about content. Read :mod:`.contents` first.
"""
